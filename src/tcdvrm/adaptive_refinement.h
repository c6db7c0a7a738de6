// Adaptive refinement of a new image: as little error as a budget allows.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/image.h"
#include "diff/frame_renderer.h"
#include "raycast/tile_caster.h"
#include "tcdvrm/block_queue.h"
#include "tcdvrm/budget_meter.h"
#include "tcdvrm/colour_pyramid.h"
#include "tcdvrm/detail_age.h"
#include "tcdvrm/detail_blend.h"
#include "tcdvrm/error_goal.h"
#include "tcdvrm/error_probe.h"
#include "tcdvrm/live_blocks.h"
#include "tcdvrm/refinement_rays.h"

namespace kairos {

/// Finds an image anew from few rays: a lattice of stride 4, then blocks of 8x8 pixels at stride 2 and 1,
/// those first whose error falls most for their cost; what lies between is interpolated, with a share of the
/// previous image's detail. The sample distance along the rays is chosen for each frame. Rays drawn for the
/// purpose tell how wrong the result is. Everything is charged to the budget's meter.
///
/// Under a budget that is an error, refinement goes on until the rays say that it is met.
///
/// What a refinement brings is learned: a block's error at stride 4 is what its refinement to stride 2 showed
/// (in this frame, or an earlier one), and so on. An exact image, the first one, teaches all of it at once.
class AdaptiveRefinement {
 public:
  /// The image is the frame shown; all references must outlive the object.
  AdaptiveRefinement(const SceneState& scene, const TileCaster& exactTiles, Image& image, BudgetMeter& meter,
                     const RendererOptions& options);

  /// After SceneState::start, with the exact image of it: forgets everything and learns from it.
  void restart();

  /// Finds the live blocks of the image anew, and refines further, where that is worth more, what earlier
  /// frames left of the others that are uncertain: not exact. The error that is reported is over all
  /// uncertain ones, which include the live.
  void refine(const BlockSet& live, const BlockSet& uncertain, FrameStatistics& statistics);

  /// What casting these blocks exactly would take, by what packets of stride 4 took there last.
  CastWork exactWork(const BlockSet& blocks) const;

  /// A tile of the image was made exact by somebody else.
  void takeExactTile(int tile);
  /// All tiles of a block are exact.
  void takeExactBlock(size_t block) {
    stride_[block] = 1;
    for (auto& found : detailFoundIn_) found[block] = frame_;
  }

  /// From which stride a block's pixels were interpolated; 1: all were cast; 32: no ray met it in its last
  /// frame.
  int strideOf(size_t block) const { return stride_[block]; }
  /// Expected squared error of a block's pixels, all channels added: a model, calibrated by the rays drawn to
  /// measure the error.
  double expectedError(size_t block) const {
    return lateralScale_ * modelledError(block) + probe_.stepBias(stepLevel_);
  }
  /// Refined frames since a pixel was last cast.
  uint32_t age(int x, int y) const {
    return frame_ - lastCast_[size_t(y) * size_t(image_.width) + size_t(x)];
  }
  uint64_t memoryBytes() const;

 private:
  static constexpr int kUnitBlocks = 2;  // blocks along the edge of a unit
  static constexpr double kBlockPixels = kBlockEdge * kBlockEdge;
  static constexpr int kNothing = 32;           // the stride of a block that no ray of the frame met
  static constexpr float kLeastError = 1e-12f;  // below what floats can show

  struct Packet {
    RefinementRays::Lattice lattice;
    int tile;
    uint32_t owner;  // block or unit
  };
  struct Item {
    uint32_t block;  // for a stride of 4: its unit
    int stride;      // to refine it to
  };
  /// Expected error against packets spent.
  struct ErrorCurve {
    struct Bucket {
      double gain = 0, packets = 0;
    };
    static size_t bucketOf(double gainPerPacket) {
      return std::bit_cast<uint32_t>(float(gainPerPacket)) >> 23;
    }

    std::array<Bucket, 256> buckets{};  // by the power of two of gain per packet
    double total = 0;
    void add(double gain, double packets);
    double after(double packets) const;
    /// Packets until no more than `error` is left.
    double packetsTo(double error) const;
  };
  struct Plan {
    int stepLevel = 0;
    int stride = 4;  // of the lattice to start from
  };

  void learnInterpolation();
  void learnSampling();
  void learn(const FrameStatistics& statistics);

  void beginFrame(const BlockSet& live, const BlockSet& uncertain);
  double castingBudget();
  double batchBudget();
  double effort(CastWork work) const;
  double wideCost() const;
  void keepOld();
  void choosePlan();
  void choosePlanForGoal();
  double expectedTotal() const;
  double gainOf(const Item& item) const;
  void findUnitGains();
  ErrorCurve errorCurve(int baseStride) const;
  CastWork workOf(int stepLevel) const;
  CastWork workOf(uint32_t unit, int stepLevel) const;
  float latticeResidual(int column, int row) const;
  uint32_t detailAge(int level, size_t block) const { return frame_ - detailFoundIn_[size_t(level)][block]; }
  double error4(size_t block) const;
  double error2(size_t block) const;
  double modelledError(size_t block) const;

  void castBatch(std::span<const Packet> packets);
  template <class Before, class Take>
  size_t castInBatches(std::span<const Packet> packets, Before&& before, Take&& take);
  double costOf(const Packet& packet) const;
  void lengthenStep(std::span<const Packet> rest);
  void castLattice();
  void castCoarseLattice();
  void expectFromCoarse();
  void keepNodes(const Packet& packet, const PacketColours& colours);
  void charge(size_t packets, bool wide);

  void queueBlocks();
  void queueOwed();
  void takeUp(uint32_t block);
  void refineBlocks();
  bool takeItems(std::vector<Item>& items);
  void refineUnits(std::span<const uint32_t> units);
  std::vector<uint32_t> liveBlocksOf(uint32_t unit) const;
  void takeStride4(const Packet& packet, const PacketColours& colours, CastWork work);
  Packet phasePacket(uint32_t block, int phase) const;
  void takeStride2(uint32_t block, const PacketColours& colours);
  void takeStride1(uint32_t block, const PacketColours* phases);
  double learnDetail(uint32_t block, const PacketColours& colours);
  bool showsOld(uint32_t block) const;
  void pushStride2(int column, int row);
  void pushStride2(uint32_t block);
  void pushStride1(uint32_t block);

  void assemble();
  void assemble(std::span<const BlockRun> runs, const DetailBlend* blend);
  void writeBlock(uint32_t block);
  bool mayBeWrong(int x, int y) const { return uncertain_.contains(uncertain_.blockAt(x, y)); }
  void measureError(FrameStatistics& statistics);
  void topUp();
  bool takeWholeBlocks(std::vector<uint32_t>& tiles);
  size_t blockOfTile(uint32_t tile) const;
  void appendTiles(uint32_t block, std::vector<uint32_t>& tiles);
  void castTiles(std::span<const uint32_t> tiles);
  void writePixel(int x, int y, const float* rgba);
  void markCast(int x, int y) { lastCast_[size_t(y) * size_t(image_.width) + size_t(x)] = frame_; }
  void report(FrameStatistics& statistics) const;

  const SceneState& scene_;
  const TileCaster& exactTiles_;
  Image& image_;
  BudgetMeter& meter_;
  StepLevels levels_;
  RefinementRays rays_;
  ErrorProbe probe_;
  std::optional<ErrorGoal> goal_;  // of budgets that are an error
  ColourPyramid pyramid_;
  DetailBlend blend_;
  const bool mayBlend_;
  std::array<DetailAge, 2> detailAge_;                  // of levels 0 and 1
  std::array<std::vector<uint32_t>, 2> detailFoundIn_;  // per block: the frame whose rays found its detail

  // Learned. Errors are squared, all channels added, per pixel.
  std::vector<float> error8_, error4_, error2_;  // per block: when interpolated from stride 8, 4, 2
  std::vector<uint32_t> unitOf_;                 // per block
  std::vector<CastWork> unitWork_;  // per unit: its packet of stride 4 at the exact sample distance
  double ratio8_ = 0.3;             // error when interpolated from stride 8, to what its nodes show
  double ratio4_ = 0.1;      // error when interpolated from stride 4, to what the lattice's own nodes show
  double ratio2_ = 0.1;      // error when interpolated from stride 2, to that from stride 4
  double lateralScale_ = 1;  // measured error to the modelled one
  RunningMedian finishMsPerBlock_{0};
  double wideCost_ = 3;  // of packets of stride 8 and 16, to what their work lets expect
  int stepLevel_ = 0;
  RunningMedian keepMs_{0};  // of what blending needs
  RunningMedian tailMs_{0};  // of what comes after the last ray
  uint32_t firstUnit_ = 0;   // of the next lattice

  // Of this frame.
  uint32_t frame_ = 0;
  double begun_ = 0, reserve_ = 0, measuredError_ = 0;
  BlockSet live_;       // to be found anew
  BlockSet uncertain_;  // not exact, the live ones included
  BlockSet added_;      // owed ones that were taken up
  std::vector<BlockRun> runs_;
  std::vector<uint32_t> unitOrder_, units_, uncertainUnits_;
  size_t liveBlocks_ = 0;
  Plan plan_;
  bool blending_ = false, tooSmall_ = false, assembled_ = false;
  CastWork meanWork_, total_;
  uint64_t raysCast_ = 0;
  struct {
    double error8 = 0, expected8 = 0, error4 = 0, expected4 = 0, error2 = 0, expected2 = 0;
  } seen_;
  BlockQueue<Item> queue_;
  std::vector<uint8_t> stride_;
  std::vector<double> unitError_;  // per unit: what is expected of it, uncertain blocks only
  std::vector<double> unitGain_;   // per unit: what casting it at stride 4 takes of the error at 8
  std::vector<uint32_t> fineAt_;   // per block at stride 1: its three packets in fine_
  std::vector<Packet> packets_;
  std::vector<PacketColours> fine_, colours_;  // colours_ and works_: of the last batch
  std::vector<CastWork> works_;
  std::vector<uint32_t> lastCast_;
};

}  // namespace kairos
