#pragma once

#include <cstdint>

#include "dem_offline/engine/contact/contact_body.h"
#include "dem_offline/engine/core/energy_sums.h"

namespace grouser::dem {

/// The kernel asks for the grains and records of a block so many blocks ahead:
/// indices are padded by as many.
inline constexpr int kBlocksAhead = 3;

/// kLanes pairs, each once: places and records of both grains. A pair of a grain
/// with itself is padding. One block after another is one stream of memory; so
/// are the histories of blocks.
struct alignas(64) PairBlock {
  std::int32_t first[kLanes], second[kLanes];
  std::int32_t first_record[kLanes], second_record[kLanes];
  std::int32_t touched;  ///< did any lane touch last step?
};

/// What the pair kernel sees: plain arrays, no owner. What a contact does to
/// its two grains goes to two records; those of a grain lie together and are
/// summed afterwards, in their order: no write is shared.
struct PairView {
  const Grain* grains;
  PairBlock* blocks;  ///< [blocks + kBlocksAhead]
  float* history;     ///< [blocks x words x kLanes] as `first` sees it; 0: no contact
  GrainLoad* records;
  const std::int32_t* record_start;  ///< [grains + 1] records of a grain
  float quantum[3];                  ///< [m]
  float range;                       ///< furthest gap at which the laws act [m]
  float dt;                          ///< [s]
  const PairParams* params;          ///< [materials x materials]
  int materials;
  WordLayout layout;
};

/// Records of the contacts of blocks [from, to); adds to *energy unless it is
/// null. Bitwise the same for every instruction set and for any split.
using PairKernelFn = void (*)(const PairView&, std::int64_t from, std::int64_t to,
                              EnergySums* energy);

/// Overwrites the loads of the grains of tiles [from, to) of kLanes with the
/// sums of their records. idle: [tiles] tiles without a grain that moves are
/// left as they are; null: none.
using SumKernelFn = void (*)(const PairView&, const std::uint8_t* idle, GrainLoad* loads,
                             std::int64_t from, std::int64_t to);

}  // namespace grouser::dem
