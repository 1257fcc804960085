#include "scene_picture/annotate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "image/cv_view.hpp"
#include "scene/class_colour.hpp"

namespace ygslam {
namespace {

constexpr Rgb8 kPaper{255, 255, 255};
const cv::Scalar kInk(30, 30, 30);
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

cv::Scalar scalar_of(Rgb8 colour) { return {double(colour.r), double(colour.g), double(colour.b)}; }

void write_text(cv::Mat& picture, const std::string& text, const cv::Point& at, double size) {
  cv::putText(picture, text, at, kFont, size, kInk, 1, cv::LINE_AA);
}

void paste(const ColourImage& from, ColourImage& to, int left, int top) {
  for (int v = 0; v < from.height(); ++v)
    std::copy_n(from.row(v), from.width(), to.row(top + v) + left);
}

constexpr int kLine_px = 26, kSwatch_px = 16, kMargin_px = 14;
constexpr double kLegendText = 0.5;

int text_width(const std::string& text, double size) {
  int baseline = 0;
  return cv::getTextSize(text, kFont, size, 1, &baseline).width;
}

void draw_entries(cv::Mat& picture, const std::vector<LegendEntry>& legend, int left) {
  const int lines = std::max(1, (picture.rows - 2 * kMargin_px) / kLine_px);
  const int count = static_cast<int>(legend.size());
  const int shown = count <= lines ? count : lines - 1;
  for (int i = 0; i < shown; ++i) {
    const LegendEntry& entry = legend[static_cast<std::size_t>(i)];
    const cv::Point corner(left, kMargin_px + i * kLine_px);
    const cv::Rect swatch(corner, cv::Size(kSwatch_px, kSwatch_px));
    cv::rectangle(picture, swatch, scalar_of(entry.colour), cv::FILLED);
    cv::rectangle(picture, swatch, kInk, 1);
    write_text(picture, entry.name, corner + cv::Point(kSwatch_px + 8, kSwatch_px - 3),
               kLegendText);
  }
  if (shown < count) {
    write_text(picture, "and " + std::to_string(count - shown) + " more",
               {left, kMargin_px + shown * kLine_px + kSwatch_px - 3}, kLegendText);
  }
}

// From the lowest colour at the bottom to the highest at the top.
void draw_gradient(cv::Mat& picture, const std::vector<LegendEntry>& ends, int left) {
  const int top = 3 * kMargin_px, height = std::min(picture.rows - 2 * top, 300);
  for (int v = 0; v < height; ++v) {
    const Rgb8 colour = height_colour(1 - v / (height - 1.0));
    cv::line(picture, {left, top + v}, {left + kSwatch_px, top + v}, scalar_of(colour));
  }
  write_text(picture, ends[1].name, {left, top - 8}, kLegendText);
  write_text(picture, ends[0].name, {left, top + height + 18}, kLegendText);
}

// The part of a line before the camera, in the picture.
struct DrawnLine {
  cv::Point from, to;
};

std::optional<DrawnLine> project_line(const Viewpoint& view, const Vec3& from_world,
                                      const Vec3& to_world) {
  constexpr double kNear_m = 0.05, kFar_px = 20'000;
  Vec3 from = view.T_camera_world * from_world, to = view.T_camera_world * to_world;
  if (from.z() > to.z()) std::swap(from, to);
  if (to.z() < kNear_m) return {};
  if (from.z() < kNear_m) from += (kNear_m - from.z()) / (to.z() - from.z()) * (to - from);
  const Vec2 middle((view.width - 1) / 2.0, (view.height - 1) / 2.0);
  const auto pixel = [&](const Vec3& p) -> Vec2 {
    return view.focal_px / p.z() * p.head<2>() + middle;
  };
  const Vec2 a = pixel(from), b = pixel(to);
  if (!(a.cwiseAbs().maxCoeff() < kFar_px && b.cwiseAbs().maxCoeff() < kFar_px)) return {};
  const auto point = [](const Vec2& p) {
    return cv::Point(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  };
  return DrawnLine{point(a), point(b)};
}

void draw_line(cv::Mat& picture, const Viewpoint& view, const Vec3& from_world,
               const Vec3& to_world, const cv::Scalar& colour) {
  const auto line = project_line(view, from_world, to_world);
  if (line) cv::line(picture, line->from, line->to, colour, 2, cv::LINE_AA);
}

bool is_drawn(const SceneObject& object) {
  return object.state != ObjectState::kAbsent && object.state != ObjectState::kCandidate;
}

/// @param i 0 to 7: a bit for each axis.
Vec3 corner_of(const OrientedBox& box, unsigned i) {
  const Vec3 side((i & 1) ? 0.5 : -0.5, (i & 2) ? 0.5 : -0.5, (i & 4) ? 0.5 : -0.5);
  return box.T_world_box * side.cwiseProduct(box.size_m);
}

}  // namespace

ColourImage with_legend(const ScenePicture& picture) {
  if (picture.legend.empty()) return picture.image;
  int widest = text_width("and 999 more", kLegendText);
  for (const LegendEntry& entry : picture.legend)
    widest = std::max(widest, text_width(entry.name, kLegendText));
  const int column = kSwatch_px + 8 + widest + 2 * kMargin_px;
  ColourImage image(picture.image.width() + column, picture.image.height(), kPaper);
  paste(picture.image, image, 0, 0);
  cv::Mat view = cv_view(image);
  const int left = picture.image.width() + kMargin_px;
  if (picture.colour == PictureColour::kHeight) {
    draw_gradient(view, picture.legend, left);
  } else {
    draw_entries(view, picture.legend, left);
  }
  return image;
}

std::vector<Vec3> box_corners(std::span<const SceneObject> objects) {
  std::vector<Vec3> corners_world;
  for (const SceneObject& object : objects)
    for (unsigned i = 0; i < 8 && is_drawn(object); ++i)
      corners_world.push_back(corner_of(object.box, i));
  return corners_world;
}

void draw_boxes(ColourImage& image, std::span<const SceneObject> objects, const Viewpoint& view,
                PictureColour by) {
  cv::Mat picture = cv_view(image);
  for (const SceneObject& object : objects) {
    if (!is_drawn(object)) continue;
    const Rgb8 colour = by == PictureColour::kClass ? class_colour(object.semantic_class)
                                                    : object_colour(object.id);
    for (unsigned i = 0; i < 8; ++i) {
      for (const unsigned axis : {1U, 2U, 4U}) {
        if (!(i & axis))
          draw_line(picture, view, corner_of(object.box, i), corner_of(object.box, i | axis),
                    scalar_of(colour));
      }
    }
    const Vec3 top = object.box.T_world_box * Vec3(0, 0, object.box.size_m.z() / 2);
    const auto at = project_line(view, top, top);
    if (!at) continue;
    const std::string name = semantic_class_name(object.semantic_class) + " " +
                             std::to_string(static_cast<int>(object.id));
    cv::putText(picture, name, at->from, kFont, 0.5, cv::Scalar(255, 255, 255), 3, cv::LINE_AA);
    write_text(picture, name, at->from, 0.5);
  }
}

void draw_path(ColourImage& image, std::span<const Vec3> path_world, const Viewpoint& view,
               Rgb8 colour) {
  cv::Mat picture = cv_view(image);
  for (std::size_t i = 1; i < path_world.size(); ++i)
    draw_line(picture, view, path_world[i - 1], path_world[i], scalar_of(colour));
}

ColourImage side_by_side(std::span<const CaptionedImage> pictures) {
  constexpr int kGap_px = 12, kCaption_px = 36;
  int width = kGap_px, height = 0;
  for (const CaptionedImage& picture : pictures) {
    width += picture.image->width() + kGap_px;
    height = std::max(height, picture.image->height());
  }
  ColourImage image(width, kCaption_px + height + kGap_px, kPaper);
  cv::Mat view = cv_view(image);
  int left = kGap_px;
  for (const CaptionedImage& picture : pictures) {
    paste(*picture.image, image, left, kCaption_px);
    write_text(view, picture.caption, {left, kCaption_px - 12}, 0.6);
    left += picture.image->width() + kGap_px;
  }
  return image;
}

}  // namespace ygslam
