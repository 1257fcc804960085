#include "bag/bag.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "bag/mcap_bag.hpp"
#include "bag/ros1_bag.hpp"
#include "bag/sqlite_bag.hpp"
#include "io/image_folders.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

enum class BagKind { kNone, kMcap, kRos1, kSqlite, kPacked };

BagKind bag_kind(const fs::path& path) {
  const auto file = InputFile::open(path);
  if (!file.ok()) return BagKind::kNone;
  constexpr std::uint64_t kLongest = 16;
  const auto start = file->read(0, std::min(kLongest, file->size()));
  if (!start.ok()) return BagKind::kNone;
  const std::string_view text(reinterpret_cast<const char*>(start->data()), start->size());
  if (text.starts_with("\x89MCAP0\r\n")) return BagKind::kMcap;
  if (text.starts_with("#ROSBAG V2.0\n")) return BagKind::kRos1;
  if (text.starts_with("SQLite format 3")) return BagKind::kSqlite;
  if (text.starts_with("\x28\xb5\x2f\xfd")) return BagKind::kPacked;
  return BagKind::kNone;
}

/// The files of a bag that is a folder, in the order in which they were written.
std::vector<fs::path> files_of_bag(const fs::path& folder) {
  constexpr std::array kEndings = {".mcap", ".db3", ".bag", ".zstd"};
  std::vector<fs::path> files;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    const std::string ending = at->path().extension().string();
    if (std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end() &&
        bag_kind(at->path()) != BagKind::kNone)
      files.push_back(at->path());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return std::pair(a.native().size(), a.native()) < std::pair(b.native().size(), b.native());
  });
  return files;
}

/// Several files as one bag.
class SplitBag final : public Bag {
 public:
  explicit SplitBag(std::vector<std::unique_ptr<Bag>> files) : files_(std::move(files)) {}

  Status visit(const Visitor& visitor, const Interrupted& interrupted) override {
    for (std::size_t i = 0; i < files_.size(); ++i) {
      Bag& file = *files_[i];
      Status visited = file.visit(
          [&](const BagMessage& message) {
            const BagTopic& topic = file.topics()[message.topic];
            BagMessage ours = message;
            ours.topic = add_topic(topic.name, topic.type, topic.layout);
            ours.place.file = i;
            visitor(ours);
          },
          interrupted);
      if (!visited.ok()) return visited;
      warnings_.insert(warnings_.end(), file.warnings().begin(), file.warnings().end());
    }
    return Ok{};
  }
  Result<Bytes> read(const MessagePlace& place) const override {
    return files_[place.file]->read(place);
  }

 private:
  std::vector<std::unique_ptr<Bag>> files_;
};

Result<std::unique_ptr<Bag>> open_bag_file(const fs::path& path) {
  const BagKind kind = bag_kind(path);
  if (kind == BagKind::kSqlite) return SqliteBag::open(path);
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  if (kind == BagKind::kMcap)
    return std::unique_ptr<Bag>(std::make_unique<McapBag>(std::move(*file)));
  if (kind == BagKind::kRos1)
    return std::unique_ptr<Bag>(std::make_unique<Ros1Bag>(std::move(*file)));
  return Error{ErrorKind::kInput,
               path.string() + (kind == BagKind::kPacked
                                    ? ": is compressed as a whole; unpack it with `zstd -d`"
                                    : ": is no bag")};
}

}  // namespace

std::string cut_name(std::string name) {
  constexpr std::size_t kLongestName = 1024;
  if (name.size() > kLongestName) {
    name.resize(kLongestName);
    name.shrink_to_fit();
  }
  return name;
}

bool shows_images(std::string_view type) {
  for (const std::string_view drawn : {"Annotation", "Marker"})
    if (type.find(drawn) != std::string_view::npos) return false;
  for (const std::string_view word : {"Image", "image", "Video"})
    if (type.find(word) != std::string_view::npos) return true;
  return false;
}

std::size_t MessageReader::add_topic(const std::string& name, const std::string& type,
                                     Layout layout) {
  std::string short_type = cut_name(type);
  if (const std::size_t at = short_type.find("/msg/"); at != std::string::npos)
    short_type.erase(at, std::strlen("/msg"));
  std::tuple key{cut_name(name), std::move(short_type), layout};
  if (const auto known = place_of_topic_.find(key); known != place_of_topic_.end())
    return known->second;
  constexpr std::size_t kLast = kMostTopics - 1;
  if (topics_.size() >= kLast) {
    // The last place is for all that are too many: of no type, so that nobody reads their messages.
    if (topics_.size() == kLast) topics_.push_back({"", "", layout});
    note("a topic after the first " + std::to_string(kLast));
    return kLast;
  }
  topics_.push_back({std::get<0>(key), std::get<1>(key), layout});
  return place_of_topic_.emplace(std::move(key), topics_.size() - 1).first->second;
}

void MessageReader::note(const std::string& fault) {
  if (faults_++ == 0) first_fault_ = fault;
}

void MessageReader::warn_of_faults(const std::string& source) {
  if (faults_ > 0)
    warnings_.push_back(source + ": " + std::to_string(faults_) +
                        " records or chunks are left out, the first: " + first_fault_);
}

bool is_bag(const fs::path& path) {
  std::error_code code;
  if (!fs::is_directory(path, code)) return bag_kind(path) != BagKind::kNone;
  for (const char* list : {"rgb.txt", "associations.txt"})  // a bag may lie beside its images
    if (fs::exists(path / list, code)) return false;
  if (fs::exists(path / "metadata.yaml", code)) return true;
  return !files_of_bag(path).empty() && !has_image_folders(path);
}

Result<std::unique_ptr<Bag>> open_bag(const fs::path& path) {
  std::error_code code;
  if (!fs::is_directory(path, code)) return open_bag_file(path);
  std::vector<std::unique_ptr<Bag>> files;
  for (const fs::path& file : files_of_bag(path)) {
    auto opened = open_bag_file(file);
    if (!opened.ok()) return opened;
    files.push_back(std::move(*opened));
  }
  if (files.empty()) return Error{ErrorKind::kInput, path.string() + ": no file of a bag is in it"};
  return std::unique_ptr<Bag>(std::make_unique<SplitBag>(std::move(files)));
}

}  // namespace ygslam
