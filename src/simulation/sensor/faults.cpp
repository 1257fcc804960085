#include "simulation/sensor/faults.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace ygslam::sim {

namespace {

struct KindInfo {
  FaultKind kind;
  double default_value;
  double least = 0, most = 0;  ///< of the value; both 0: there is none
};

const std::map<std::string, KindInfo>& kinds() {
  static const std::map<std::string, KindInfo> table = {
      {"off", {FaultKind::kOff, 0}},
      {"stuck", {FaultKind::kStuck, 0}},
      {"garbage", {FaultKind::kGarbage, 0}},
      {"scale", {FaultKind::kScale, 5, 0.001, 1000}},
      {"slow", {FaultKind::kSlow, 3, 1, 1000}},
      {"delayed", {FaultKind::kDelayed, 0.05, 0, 10}},
      {"intermittent", {FaultKind::kIntermittent, 0.5, 0, 1}},
      {"drop", {FaultKind::kDrop, 0.3, 0, 1}},
      {"disorder", {FaultKind::kDisorder, 0}},
      {"black", {FaultKind::kBlack, 0}},
      {"white", {FaultKind::kWhite, 0}},
      {"truncate", {FaultKind::kTruncate, 0}},
      {"empty", {FaultKind::kEmpty, 1, 0, 1}}};
  return table;
}

Error grammar(const std::string& text) {
  std::string names;
  for (const auto& [name, info] : kinds()) names += (names.empty() ? "" : "|") + name;
  return {
      ErrorKind::kUsage,
      "'" + text +
          "' is no fault: write rgb|depth|both:KIND[=VALUE]@START[s]+DURATION[s], KIND one of " +
          names};
}

/// Of each pixel with this probability.
template <typename Image, typename Pixel>
void lose(Image& image, const Pixel& nothing, double share, Rng& rng) {
  for (Pixel& pixel : image)
    if (rng.uniform() < share) pixel = nothing;
}

std::optional<double> number(std::string text) {
  if (!text.empty() && text.back() == 's') text.pop_back();
  if (text.empty()) return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (*end != '\0' || !std::isfinite(value) || value < 0) return std::nullopt;
  return value;
}

}  // namespace

Result<Fault> parse_fault(const std::string& text) {
  const auto colon = text.find(':');
  const auto at = text.find('@');
  const auto plus = text.find('+', at == std::string::npos ? 0 : at);
  if (colon == std::string::npos || at == std::string::npos || plus == std::string::npos ||
      colon > at)
    return grammar(text);
  Fault fault;
  const std::string stream = text.substr(0, colon);
  if (stream == "rgb") {
    fault.stream = Stream::kColour;
  } else if (stream == "depth") {
    fault.stream = Stream::kDepth;
  } else if (stream != "both") {
    return grammar(text);
  }
  std::string kind = text.substr(colon + 1, at - colon - 1);
  std::optional<double> value;
  if (const auto equals = kind.find('='); equals != std::string::npos) {
    value = number(kind.substr(equals + 1));
    if (!value) return grammar(text);
    kind = kind.substr(0, equals);
  }
  const auto found = kinds().find(kind);
  const auto from_s = number(text.substr(at + 1, plus - at - 1));
  const auto duration_s = number(text.substr(plus + 1));
  if (found == kinds().end() || !from_s || !duration_s) return grammar(text);
  const KindInfo& info = found->second;
  if (value && info.most == 0)
    return Error{ErrorKind::kUsage, "'" + text + "': '" + found->first + "' takes no value"};
  if (value && (*value < info.least || *value > info.most)) {
    std::ostringstream range;
    range << "'" << text << "': the value of '" << found->first << "' is " << info.least << " to "
          << info.most;
    return Error{ErrorKind::kUsage, range.str()};
  }
  if (*duration_s <= 0)
    return Error{ErrorKind::kUsage, "'" + text + "': a fault lasts longer than nothing"};
  fault.kind = found->second.kind;
  fault.value = value.value_or(found->second.default_value);
  fault.from_s = *from_s;
  fault.duration_s = *duration_s;
  return fault;
}

FaultInjector::FaultInjector(std::vector<Fault> faults, double frame_s, std::uint64_t seed)
    : faults_(std::move(faults)), frame_s_(frame_s), seed_(seed) {
  for (const Fault& fault : faults_) {
    if (fault.kind != FaultKind::kDelayed) continue;
    history_frames_ =
        std::max(history_frames_, static_cast<std::size_t>(std::lround(fault.value / frame_s)) + 1);
  }
}

void FaultInjector::apply_one(const Fault& fault, int index, ColourImage& colour,
                              DepthImage& depth_m, Delivery& delivery, Rng& rng) {
  const bool on_colour = fault.stream != Stream::kDepth;
  const bool on_depth = fault.stream != Stream::kColour;
  const auto random_byte = [&] { return static_cast<std::uint8_t>(rng.below(256)); };
  switch (fault.kind) {
    case FaultKind::kOff:
      delivery.colour &= !on_colour;
      if (on_depth) std::fill(depth_m.begin(), depth_m.end(), 0.0F);
      return;
    case FaultKind::kStuck:
      if (on_colour && !stuck_colour_.empty()) colour = stuck_colour_;
      if (on_depth && !stuck_depth_m_.empty()) depth_m = stuck_depth_m_;
      return;
    case FaultKind::kGarbage:
      if (on_colour) {
        for (Rgb8& p : colour) p = {random_byte(), random_byte(), random_byte()};
      }
      if (on_depth) {
        for (float& d : depth_m) d = static_cast<float>(rng.uniform(0, 13));
      }
      return;
    case FaultKind::kScale:
      for (float& d : depth_m) d *= static_cast<float>(fault.value);
      return;
    case FaultKind::kSlow: {
      const bool skip = index % std::max(1, static_cast<int>(fault.value)) != 0;
      delivery.colour &= !(skip && on_colour);
      delivery.depth &= !(skip && on_depth);
      return;
    }
    case FaultKind::kDelayed: {
      const auto frames = static_cast<std::size_t>(std::lround(fault.value / frame_s_));
      const std::size_t back = std::min(frames, colours_.size() - 1);
      if (on_colour) colour = colours_[colours_.size() - 1 - back];
      if (on_depth) depth_m = depths_m_[depths_m_.size() - 1 - back];
      return;
    }
    case FaultKind::kIntermittent:
      if (rng.uniform() < fault.value) {
        delivery.colour &= !on_colour;
        delivery.depth &= !on_depth;
      }
      return;
    case FaultKind::kDrop:
      if (rng.uniform() < fault.value) delivery.frame = false;
      return;
    case FaultKind::kDisorder: {
      // The second of two frames claims to be older than the first.
      const std::int64_t frame_ns = to_ns(frame_s_);
      delivery.stamp.ns += index % 2 == 0 ? frame_ns : -frame_ns;
      return;
    }
    case FaultKind::kBlack:
    case FaultKind::kWhite:
      if (on_colour) {
        const std::uint8_t value = fault.kind == FaultKind::kBlack ? 0 : 255;
        std::fill(colour.begin(), colour.end(), Rgb8{value, value, value});
      }
      if (on_depth) std::fill(depth_m.begin(), depth_m.end(), 0.0F);
      return;
    case FaultKind::kEmpty:
      if (on_colour) lose(colour, Rgb8{0, 0, 0}, fault.value, rng);
      if (on_depth) lose(depth_m, 0.0F, fault.value, rng);
      return;
    case FaultKind::kTruncate:
      delivery.truncate_colour |= on_colour;
      delivery.truncate_depth |= on_depth;
      return;
  }
}

Delivery FaultInjector::apply(int index, double t_s, Timestamp stamp, ColourImage& colour,
                              DepthImage& depth_m) {
  Delivery delivery;
  delivery.stamp = stamp;
  if (faults_.empty()) return delivery;
  colours_.push_back(colour);
  depths_m_.push_back(depth_m);
  if (colours_.size() > history_frames_) {
    colours_.erase(colours_.begin());
    depths_m_.erase(depths_m_.begin());
  }
  const bool stuck_now = std::any_of(faults_.begin(), faults_.end(), [&](const Fault& f) {
    return f.kind == FaultKind::kStuck && f.covers(t_s);
  });
  if (!stuck_now || stuck_colour_.empty()) {
    stuck_colour_ = colour;
    stuck_depth_m_ = depth_m;
  }
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    if (!faults_[i].covers(t_s)) continue;
    Rng rng(seed_ * 1000003U + static_cast<std::uint64_t>(index) * 7919U + i);
    apply_one(faults_[i], index, colour, depth_m, delivery, rng);
  }
  return delivery;
}

}  // namespace ygslam::sim
