#include "io/named_images.hpp"

#include "io/image_file.hpp"
#include "io/name_times.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;

Result<std::map<std::string, std::string>> images_at(const fs::path& root,
                                                     const ImagePlace& place) {
  std::map<std::string, std::string> found;
  std::error_code code;
  for (fs::directory_iterator at(root / place.folder, code), end; !code && at != end;
       at.increment(code)) {
    const fs::path name = at->path().filename();
    const std::string stem = name.stem().string();
    if (!has_image_ending(name) || !stem.starts_with(place.start) || !stem.ends_with(place.end))
      continue;
    const auto [known, is_new] = found.try_emplace(stem, (fs::path(place.folder) / name).string());
    if (!is_new)
      return Error{ErrorKind::kInput, (root / place.folder).string() + ": which one is it, " +
                                          printable(fs::path(known->second).filename().string()) +
                                          " or " + printable(name.string()) +
                                          "? keep images of one kind"};
  }
  return found;
}

Result<NamedImages> named_images(const fs::path& root,
                                 const std::map<std::string, std::string>& files,
                                 ListCounts& counts) {
  std::vector<std::string> stems;
  for (const auto& [stem, file] : files) stems.push_back(stem);
  const fs::path folder = (root / files.begin()->second).parent_path();
  const auto times = times_of_names(stems);
  if (!times.ok())
    return Error{ErrorKind::kInput, folder.string() + ": " + times.error().message +
                                        "; write rgb.txt and depth.txt with lines `seconds file`"};
  NamedImages named;
  std::size_t i = 0;
  for (const auto& [stem, file] : files) {
    const auto& stamp = times->stamps[i++];
    counts.malformed += stamp ? 0 : 1;
    if (stamp) named.images.push_back({*stamp, times->decimals, file});
  }
  counts.lines += files.size();
  named.images = in_time_order(std::move(named.images), counts);
  named.is_frames = times->is_frames;
  const ListedImage& last = named.images.back();
  named.told = times->taken_as + ": " + printable(last.file) + " at " +
               format_stamp(last.stamp, last.decimals) + " s";
  return named;
}

}  // namespace ygslam
