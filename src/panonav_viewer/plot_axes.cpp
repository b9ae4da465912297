#include "panonav_viewer/plot_axes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panonav/core/text.hpp"

namespace panonav::viewer {

namespace {

constexpr double x_tick_px = 60.0;  ///< smallest distance between tick marks
constexpr double y_tick_px = 34.0;
constexpr double tick_label_rotation_deg = -40.0;  ///< rotation of names that would overlap
constexpr double min_rotated_tick_label_distance_px = 16.0;
constexpr double legend_row_px = 18.0;
constexpr double symbol_px = 24.0;

double find_step(double range, double max_count) {
  const double min_step = range / std::max(1.0, max_count);
  const double power = std::pow(10.0, std::floor(std::log10(min_step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= min_step * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::vector<double> find_log_ticks(double low, double high) {
  const double decades = std::log10(high / low);
  std::vector<double> factors{1.0};
  if (decades <= 2.5) factors = {1.0, 3.0};
  if (decades <= 1.0) factors = {1.0, 2.0, 5.0};
  std::vector<double> found;
  for (double power = std::pow(10.0, std::floor(std::log10(low))); power <= high; power *= 10.0) {
    for (const double factor : factors) {
      const double tick = power * factor;
      if (tick >= low * 0.999 && tick <= high * 1.001) found.push_back(tick);
    }
  }
  return found;
}

}  // namespace

double PlotAxis::fraction_of(double value) const {
  if (!is_log) return (value - from) / (to - from);
  if (!(value > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  return std::log(value / from) / std::log(to / from);
}

std::vector<double> PlotAxis::ticks(double max_count) const {
  const double low = std::min(from, to);
  const double high = std::max(from, to);
  if (is_log) return find_log_ticks(low, high);
  const bool is_tick_usable = tick > 0.0 && (high - low) / tick <= max_count;
  const double step = is_tick_usable ? tick : find_step(high - low, max_count);
  std::vector<double> found;
  for (double i = std::ceil(low / step - 1e-6); i * step <= high + 1e-6 * step; ++i) {
    found.push_back(i * step);
  }
  return found;
}

void PlotAxis::set_range_to_fit(std::span<const double> values, bool with_zero) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const double value : values) {
    if (!std::isfinite(value) || (is_log && value <= 0.0)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) {
    low = is_log ? 0.1 : 0.0;
    high = 1.0;
  }
  if (is_log) {
    constexpr double room = 1.2;
    from = low / room;
    to = high * room;
    return;
  }
  if (with_zero) {
    low = std::min(low, 0.0);
    high = std::max(high, 0.0);
  }
  if (high - low < 1e-9 * std::max(std::abs(low), std::abs(high)) || high == low) {
    const double room = low == 0.0 ? 1.0 : 0.5 * std::abs(low);
    low -= room;
    high += room;
  }
  constexpr double steps = 8.0;
  const double step = find_step(high - low, steps);
  from = std::floor(low / step + 1e-6) * step;
  to = std::ceil(high / step - 1e-6) * step;
}

Point2 PlotArea::to_px(double x_value, double y_value) const {
  return {box.left + x.fraction_of(x_value) * box.width,
          box.bottom() - y.fraction_of(y_value) * box.height};
}

std::vector<Point2> PlotArea::to_px(std::span<const Point2> points) const {
  std::vector<Point2> all;
  all.reserve(points.size());
  for (const Point2& point : points) all.push_back(to_px(point.x_m, point.y_m));
  return all;
}

bool PlotArea::has_rotated_tick_labels() const {
  const double room = box.width / static_cast<double>(x.tick_labels.size());
  return std::ranges::any_of(x.tick_labels, [room](const auto& name) {
    return estimate_text_width(name.second) + 6.0 > room;
  });
}

double PlotArea::extra_margin_px() const {
  if (!has_rotated_tick_labels()) return 0.0;
  double longest = 0.0;
  for (const auto& [at, name] : x.tick_labels)
    longest = std::max(longest, estimate_text_width(name));
  return 0.65 * longest;  // sin(40 deg)
}

void PlotArea::draw_grid(SvgDrawing& drawing) const {
  const LineStyle thin{.width = 1.0};
  if (x.tick_labels.empty()) {
    for (const double tick : x.ticks(box.width / x_tick_px)) {
      const double at = box.left + x.fraction_of(tick) * box.width;
      drawing.add_path(std::vector<Point2>{{at, box.top}, {at, box.bottom()}},
                       PlotColour::pale_grey, thin);
    }
  }
  for (const double tick : y.ticks(box.height / y_tick_px)) {
    const double at = box.bottom() - y.fraction_of(tick) * box.height;
    drawing.add_path(std::vector<Point2>{{box.left, at}, {box.right(), at}}, PlotColour::pale_grey,
                     thin);
  }
}

void PlotArea::draw_axes(SvgDrawing& drawing, const std::string& title) const {
  drawing.add_frame(box, PlotColour::dark_grey);
  if (x.tick_labels.empty()) {
    for (const double tick : x.ticks(box.width / x_tick_px)) {
      drawing.add_text({box.left + x.fraction_of(tick) * box.width, box.bottom() + 16.0},
                       format_number(tick), {.anchor = "middle"});
    }
  } else {
    draw_tick_labels(drawing);
  }
  for (const double tick : y.ticks(box.height / y_tick_px)) {
    drawing.add_text({box.left - 6.0, box.bottom() - y.fraction_of(tick) * box.height + 4.0},
                     format_number(tick), {.anchor = "end"});
  }
  const double middle = box.left + 0.5 * box.width;
  drawing.add_text({middle, box.bottom() + 36.0 + extra_margin_px()}, x.label,
                   {.anchor = "middle"});
  drawing.add_text({box.left - left_margin_px + 16.0, box.top + 0.5 * box.height}, y.label,
                   {.anchor = "middle", .rotation_deg = -90.0});
  // Use a smaller font if the title would be wider than the plot.
  const double size = std::clamp(12.0 * box.width / (1.0 + estimate_text_width(title)), 8.0, 12.0);
  drawing.add_text({middle, box.top - 10.0}, title, {.anchor = "middle", .size = size});
}

void PlotArea::draw_tick_labels(SvgDrawing& drawing) const {
  constexpr std::size_t max_characters = 47;
  const bool is_rotated = has_rotated_tick_labels();
  // Draw only every n-th name if even rotated names would overlap.
  const auto every =
      static_cast<std::size_t>(1.0 + static_cast<double>(x.tick_labels.size()) *
                                         min_rotated_tick_label_distance_px / box.width);
  for (std::size_t i = 0; i < x.tick_labels.size(); i += every) {
    const auto& [value, name] = x.tick_labels[i];
    const double at = box.left + x.fraction_of(value) * box.width;
    const TextStyle style =
        is_rotated ? TextStyle{.anchor = "end", .rotation_deg = tick_label_rotation_deg}
                   : TextStyle{.anchor = "middle"};
    drawing.add_text({is_rotated ? at + 4.0 : at, box.bottom() + 16.0},
                     shorten_middle(to_readable_line(name), max_characters), style);
  }
}

void LegendSymbol::draw(SvgDrawing& drawing, Point2 at) const {
  if (area_opacity > 0.0) {
    drawing.add_box({at.x_m, at.y_m - 5.0, symbol_px, 10.0}, colour, area_opacity);
  }
  if (line) {
    drawing.add_path(std::vector<Point2>{at, {at.x_m + symbol_px, at.y_m}}, colour, *line);
  }
  if (mark) {
    drawing.add_marks(std::vector<Point2>{{at.x_m + 0.5 * symbol_px, at.y_m}}, colour, *mark);
  }
}

void Legend::add(const std::string& label, const LegendSymbol& symbol) {
  const auto is_same = [&](const auto& entry) {
    return entry.first == label && entry.second.colour == symbol.colour;
  };
  if (label.empty() || std::ranges::any_of(entries_, is_same)) return;
  entries_.emplace_back(label, symbol);
  entry_width_ = std::max(entry_width_, symbol_px + 24.0 + estimate_text_width(label));
}

std::size_t Legend::columns(double width) const {
  return std::clamp<std::size_t>(static_cast<std::size_t>(width / entry_width_), 1,
                                 entries_.size());
}

double Legend::height(double width) const {
  if (entries_.empty()) return 0.0;
  const std::size_t rows = (entries_.size() + columns(width) - 1) / columns(width);
  return legend_row_px * static_cast<double>(rows) + 10.0;
}

void Legend::draw(SvgDrawing& drawing, double width, double top) const {
  if (entries_.empty()) return;
  const std::size_t count = columns(width);
  const double left = std::max(8.0, 0.5 * (width - static_cast<double>(count) * entry_width_));
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const auto& [label, symbol] = entries_[i];
    const Point2 at{left + static_cast<double>(i % count) * entry_width_,
                    top + legend_row_px * (0.5 + static_cast<double>(i / count))};
    symbol.draw(drawing, at);
    drawing.add_text({at.x_m + symbol_px + 6.0, at.y_m + 4.0}, label);
  }
}

}  // namespace panonav::viewer
