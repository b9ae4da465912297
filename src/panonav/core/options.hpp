#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace panonav {

/// What a person must know of one option. Options live once, as members of the struct of their
/// module; the command line, TOML files and bindings are derived from `visit_options`.
struct OptionInfo {
  std::string_view name;  ///< snake_case, with its unit as in the member's name
  std::string_view help;  ///< one plain line
  double low = -std::numeric_limits<double>::infinity();  ///< smallest allowed value
  double high = std::numeric_limits<double>::infinity();  ///< largest allowed value
  bool low_open = false;                                  ///< `low` itself is not allowed
};

/// Visits the members of an options struct. Each options struct `T` has a function
/// `void visit_options(T&, OptionVisitor&)` beside it that calls `visit` once per member.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  virtual void visit(const OptionInfo& info, int& value) = 0;
  virtual void visit(const OptionInfo& info, double& value) = 0;
  virtual void visit(const OptionInfo& info, bool& value) = 0;
  /// `value` is an index into `choices`.
  virtual void visit(const OptionInfo& info, std::span<const std::string_view> choices,
                     int& value) = 0;
};

/// The allowed range in words: ">= 1 and <= 20".
[[nodiscard]] std::string range_text(const OptionInfo& info);

/// Every value that is out of its range or not a number, one sentence each; empty when all is well.
[[nodiscard]] std::vector<std::string> option_faults(const OptionInfo& info, double value);

namespace detail {
class FaultCollector final : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& value) override;
  void visit(const OptionInfo& info, double& value) override;
  void visit(const OptionInfo& info, bool& value) override;
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override;
  /// Throws OptionError with all faults in one line, if there are any.
  void finish() const;

 private:
  std::vector<std::string> faults_;
};
}  // namespace detail

/// Throws OptionError that lists all faults of `options`: field, value, allowed range.
template <class Options>
void validate(const Options& options) {
  Options copy = options;
  detail::FaultCollector collector;
  visit_options(copy, collector);
  collector.finish();
}

}  // namespace panonav
