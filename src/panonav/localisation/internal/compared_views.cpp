#include "panonav/localisation/internal/compared_views.hpp"

#include <memory>
#include <utility>

namespace panonav {

namespace {

class HeldViews final : public ComparedViews {
 public:
  explicit HeldViews(std::shared_ptr<const ColumnRanking> ranking) : ranking_(std::move(ranking)) {}
  [[nodiscard]] SignatureShape shape() const override { return ranking_->memory().shape(); }
  [[nodiscard]] int components() const override { return ranking_->components(); }
  [[nodiscard]] std::vector<PosedView> posed_views() override {
    return HeldViewIndex(ranking_->memory()).posed_views();
  }
  [[nodiscard]] std::vector<Match> search(const PackedSignature& view, int count) override {
    return ranking_->memory()
        .search(view, {.top = count, .components = ranking_->components()})
        .matches;
  }
  void load(std::span<const ViewId> views, const ProfileCallback& consume) override {
    const VisualMemory& memory = ranking_->memory();
    // The filter caches them.
    for (std::size_t i = 0; i < views.size(); ++i)
      consume(i, std::make_shared<const ColumnProfiles>(memory.packed(views[i]), components()));
  }

 private:
  std::shared_ptr<const ColumnRanking> ranking_;
};

class IndexedViews final : public ComparedViews {
 public:
  IndexedViews(std::function<std::unique_ptr<ViewIndex>()> open_index, SignatureShape shape)
      : open_index_(std::move(open_index)), shape_(shape) {}
  [[nodiscard]] SignatureShape shape() const override { return shape_; }
  [[nodiscard]] int components() const override { return 0; }
  [[nodiscard]] std::vector<PosedView> posed_views() override { return index().posed_views(); }
  [[nodiscard]] std::vector<Match> search(const PackedSignature& view, int count) override {
    return index().search(view, {.top = count}, {}).matches;
  }
  void load(std::span<const ViewId> views, const ProfileCallback& consume) override {
    const VisualMemory loaded = index().load(views);
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (loaded.contains(views[i]))
        consume(i, std::make_shared<const ColumnProfiles>(loaded.packed(views[i])));
    }
  }
  void release() override { index_.reset(); }

 private:
  ViewIndex& index() {
    if (!index_) index_ = open_index_();
    return *index_;
  }
  std::function<std::unique_ptr<ViewIndex>()> open_index_;
  SignatureShape shape_;
  std::unique_ptr<ViewIndex> index_;  // during one image
};

}  // namespace

std::unique_ptr<ComparedViews> make_compared_views(std::shared_ptr<const ColumnRanking> ranking) {
  return std::make_unique<HeldViews>(std::move(ranking));
}

std::unique_ptr<ComparedViews> make_compared_views(
    std::function<std::unique_ptr<ViewIndex>()> open_index, SignatureShape shape) {
  return std::make_unique<IndexedViews>(std::move(open_index), shape);
}

}  // namespace panonav
