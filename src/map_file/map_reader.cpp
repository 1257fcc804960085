#include "map_file/map_reader.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "map/map_fields.hpp"

namespace ygslam::map_file {
namespace {

/// A keyframe's parent and time, as its checksum is made of them.
struct KeyframeRow {
  std::int64_t parent = -1;
  std::int64_t stamp_ns = 0;
};

/// Any possible, where the file does not say any more which there can be.
MapAssembly::Numbers numbers_of(const Meta& meta) {
  if (meta.fault.empty()) return meta.numbers;
  return {MapAssembly::kMostIds, MapAssembly::kMostIds,
          std::min(meta.numbers.version, MapAssembly::kMostVersions)};
}

}  // namespace

MapReader::MapReader(OpenedMap& opened, const Camera& camera, const FaultSink& on_fault)
    : opened_(opened),
      camera_(camera),
      on_fault_(on_fault),
      assembly_(PyramidScales(opened.meta.info.pyramid_levels, opened.meta.info.pyramid_factor),
                numbers_of(opened.meta), camera.ideal_bounds()),
      budget_(DecodeBudget::of_file(opened.meta.info.bytes)) {
  by_id_.push_back(
      opened_.database.prepare("SELECT parent, stamp_ns, checksum FROM keyframe WHERE id = ?"));
  for (std::size_t table = 1; table < kTables; ++table)
    by_id_.push_back(opened_.database.prepare(
        fmt::format("SELECT data FROM {} WHERE id = ?", kTableNames[table])));
}

void MapReader::fault(const std::string& what) {
  complete_ = false;
  if (!stopped_ && !on_fault_(what)) stopped_ = true;
}

void MapReader::fault(const RowKey& key, const std::string& what) {
  fault(fmt::format("{} {}: {}", name_of(key.table), key.id, what));
}

/// From both ends where the way through the table is broken in the middle.
MapReader::Ids MapReader::ids_of(Table table) {
  Ids ids;
  for (const char* order : {"ASC", "DESC"}) {
    auto rows = opened_.database.prepare(
        fmt::format("SELECT id FROM {} ORDER BY id {}", name_of(table), order));
    while (rows && rows->next() && !stopped_) {
      const std::int64_t id = rows->integer(0).value_or(-1);
      if (id < 0 || id >= index(kNoKeyframe)) {
        fault(fmt::format("{} {}: no number of a row", name_of(table), id));
      } else {
        ids.push_back(static_cast<std::uint32_t>(id));
      }
    }
    if (rows && !rows->failed()) break;
    fault(fmt::format("{}: {}", name_of(table), opened_.database.message()));
  }
  std::ranges::sort(ids);
  const auto twice = std::ranges::unique(ids);
  ids.erase(twice.begin(), twice.end());
  return ids;
}

bool MapReader::load(const RowKey& key) {
  auto& row = by_id_[static_cast<std::size_t>(key.table)];
  if (!row) {
    fault(key, "cannot be read");
    return false;
  }
  row->reset();
  row->bind(1, key.id);
  const char* wrong = nullptr;
  if (!row->next()) {
    if (!row->failed()) {
      wrong = "is missing";
    } else {
      fault(key, opened_.database.message());
    }
  } else if (key.table == Table::kKeyframe) {
    const auto parent = row->integer(0);
    const auto stamp_ns = row->integer(1);
    const auto checksum = row->integer(2);
    if (!parent || !stamp_ns || !checksum) {
      wrong = "a value is of another type";
    } else {
      const KeyframeRow numbers{*parent, *stamp_ns};
      row_.raw.assign(reinterpret_cast<const char*>(&numbers), sizeof(numbers));
      row_.hash = hash_of(row_.raw);
      if (*checksum != checksum_of(key, row_.raw)) wrong = "damaged: the checksum does not match";
    }
  } else if (const auto data = row->bytes(0); !data) {
    wrong = "a value is of another type";
  } else {
    wrong = codec_.decode(key, *data, budget_, row_);
  }
  const bool ok = wrong == nullptr && !row->failed();
  if (wrong != nullptr) fault(key, wrong);
  row->reset();
  return ok;
}

bool MapReader::with_row(const RowKey& key, const std::function<void(ArchiveReader&)>& read) {
  if (stopped_ || !load(key)) return false;
  digest_ += share_of(key, row_.hash);
  ArchiveReader in(row_.raw);
  read(in);
  in.check_end();
  if (!in.ok()) fault(key, in.fault());
  return in.ok();
}

KeyframeId MapReader::kept_before(KeyframeId id) const {
  const auto& kept = assembly_.map().keyframes();
  const auto next = kept.lower_bound(id);
  return next == kept.begin() ? kNoKeyframe : std::prev(next)->first;
}

/// @return the parent, or where it is lost the kept one that it had or that was made before.
KeyframeId MapReader::kept_parent(KeyframeId id, KeyframeId parent) {
  if (parent == kNoKeyframe || assembly_.map().has_keyframe(parent)) return parent;
  if (const auto lost = lost_.find(parent); lost != lost_.end() && parent < id)
    return lost->second.parent;
  if (removed_.contains(parent) && parent < id) return parent;
  fault(RowKey{Table::kKeyframe, index(id)},
        fmt::format("its parent {} is not there or not older", index(parent)));
  return kept_before(id);
}

void MapReader::read_keyframe(KeyframeId id) {
  KeyframeRow numbers;
  auto data = std::make_shared<KeyframeData>();
  data->id = id;
  std::optional<SE3> T_camera_world;
  std::vector<float> weight;
  const auto key = [&](Table table) { return RowKey{table, index(id)}; };
  bool whole = with_row(key(Table::kKeyframe), [&](ArchiveReader& in) {
    in.number(numbers);
    in.check(numbers.parent >= -1 && numbers.parent < index(kNoKeyframe), "no parent can be that");
  });
  KeyframeId parent = kept_before(id);
  if (whole)
    parent = kept_parent(id, numbers.parent < 0
                                 ? kNoKeyframe
                                 : KeyframeId{static_cast<std::uint32_t>(numbers.parent)});
  SE3 T;
  if (with_row(key(Table::kPose), [&](ArchiveReader& in) { map_fields::pose(in, T); }))
    T_camera_world = T;
  whole = T_camera_world.has_value() && whole;
  whole = with_row(key(Table::kSeen),
                   [&](ArchiveReader& in) { map_fields::seen(in, *data, &camera_); }) &&
          whole;
  whole = with_row(key(Table::kWeight),
                   [&](ArchiveReader& in) { map_fields::static_weight(in, weight); }) &&
          whole;
  data->stamp.ns = numbers.stamp_ns;
  if (whole) {
    const auto wrong = assembly_.add_keyframe(std::move(data), T, parent, std::move(weight));
    if (!wrong) return;
    fault(*wrong);
  }
  lost_[id] = {removed_.contains(parent) ? kept_before(id) : parent, T_camera_world};
}

void MapReader::read_keyframes() {
  std::set<std::uint32_t> all;
  for (const Table table : {Table::kKeyframe, Table::kPose, Table::kSeen, Table::kWeight}) {
    const Ids ids = ids_of(table);
    all.insert(ids.begin(), ids.end());
  }
  for (const std::uint32_t id : all) {
    if (stopped_) return;
    read_keyframe(KeyframeId{id});
  }
}

void MapReader::read_removed() {
  for (const std::uint32_t chunk : ids_of(Table::kRemoved)) {
    std::vector<RemovedKeyframe> removed;
    const bool whole = with_row({Table::kRemoved, chunk}, [&](ArchiveReader& in) {
      in.count(removed, sizeof(PackedPose));
      for (RemovedKeyframe& r : removed) {
        map_fields::removed_keyframe(in, r);
        in.check(index(r.id) / kChunk == chunk, "a keyframe of another chunk");
      }
    });
    for (const RemovedKeyframe& r : removed)
      if (whole && !removed_.emplace(r.id, r).second)
        fault(fmt::format("removed keyframe {}: comes twice", index(r.id)));
  }
}

void MapReader::add_landmark(Landmark landmark, std::uint8_t source) {
  if (!lost_.empty()) {
    const auto is_lost = [&](const LandmarkObservation& o) { return lost_.contains(o.keyframe); };
    auto& seen = landmark.observations;
    if (source != map_fields::kOwnDescriptor && source < seen.size()) {
      // Of one that is lost the next best: the first that is kept.
      const auto own = seen.begin() + source;
      source = is_lost(*own)
                   ? 0
                   : static_cast<std::uint8_t>(source - std::count_if(seen.begin(), own, is_lost));
    }
    std::erase_if(seen, is_lost);
    if (seen.empty()) return;  // told of with its keyframes
  }
  const std::size_t count = landmark.observations.size();
  if (const auto wrong = assembly_.add_landmark(std::move(landmark), source)) {
    fault(*wrong);
  } else {
    observations_ += count;
  }
}

void MapReader::read_chunk(std::uint32_t chunk) {
  std::vector<Landmark> landmarks;
  map_fields::LandmarkExtras extras;
  extras.most = kChunk;
  bool whole = with_row({Table::kLandmarks, chunk}, [&](ArchiveReader& in) {
    map_fields::landmarks(in, landmarks, extras);
    for (const Landmark& l : landmarks)
      in.check(index(l.id) / kChunk == chunk, "a landmark of another chunk");
  });
  whole = with_row({Table::kObservations, chunk},
                   [&](ArchiveReader& in) {
                     if (whole) return map_fields::observations(in, landmarks);
                     std::vector<char> unread(in.remaining());
                     for (char& byte : unread) in.number(byte);
                   }) &&
          whole;
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    if (whole && !stopped_) add_landmark(std::move(landmarks[i]), extras.sources[i]);
}

void MapReader::read_landmarks() {
  std::set<std::uint32_t> chunks;
  for (const Table table : {Table::kLandmarks, Table::kObservations}) {
    const Ids ids = ids_of(table);
    chunks.insert(ids.begin(), ids.end());
  }
  for (const std::uint32_t chunk : chunks) {
    if (stopped_) return;
    read_chunk(chunk);
  }
}

void MapReader::check_sums() {
  if (!complete_) return;  // a fault has been told of: the sums say nothing more
  const MapFileInfo& info = opened_.meta.info;
  const auto compare = [&](const char* what, std::uint64_t said, std::uint64_t there) {
    if (said != there) fault(fmt::format("{} {} of {}", there, what, said));
  };
  compare("keyframes", info.keyframes, assembly_.map().keyframes().size());
  compare("removed keyframes", info.removed_keyframes, removed_.size());
  compare("landmarks", info.landmarks, assembly_.map().landmark_count());
  compare("observations", info.observations, observations_);
  if (complete_ && digest_ != opened_.meta.rows_digest)
    fault("damaged: its rows do not belong together");
}

void MapReader::add_removed() {
  // A lost keyframe whose pose is known goes on as a removed one: what refers to it keeps its
  // place.
  const Map& map = assembly_.map();
  for (const auto& [id, lost] : lost_) {
    if (!lost.T_camera_world || lost.parent == kNoKeyframe || removed_.contains(id)) continue;
    const SE3& T_parent_world = map.keyframe(lost.parent).T_camera_world;
    removed_[id] = {id, lost.parent, PackedPose(*lost.T_camera_world * T_parent_world.inverse())};
  }
  std::set<KeyframeId> added;
  for (const auto& [id, removed] : removed_) {
    if (!map.has_keyframe(removed.parent) && !added.contains(removed.parent)) {
      fault(fmt::format("removed keyframe {}: its parent {} is not there or not older", index(id),
                        index(removed.parent)));
    } else if (const auto wrong = assembly_.add_removed(removed)) {
      fault(*wrong);
    } else {
      added.insert(id);
    }
  }
}

std::optional<Map> MapReader::read() {
  if (!opened_.meta.fault.empty()) fault(opened_.meta.fault);
  read_removed();
  read_keyframes();
  read_landmarks();
  check_sums();
  add_removed();
  if (const auto wrong = assembly_.parent_fault()) fault(*wrong);
  if (stopped_ || assembly_.parent_fault()) return std::nullopt;
  const bool is_sure = opened_.meta.fault.empty();
  if (!is_sure) assembly_.number_by_parts();
  Map map = assembly_.finish();
  if (is_sure) map.set_identity(parse_identity(opened_.meta.info.uuid));
  return map;
}

}  // namespace ygslam::map_file
