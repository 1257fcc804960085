// A frame with what the system thinks of it: masks tinted, static points green, dynamic points red,
// unknown points yellow (the paper's Fig. 5).
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <span>
#include <string>

#include "core/result.hpp"
#include "image/rgbd_frame.hpp"
#include "motion/classification/point_labels.hpp"
#include "objects/object_tracker.hpp"

namespace ygslam {

/// A copy of the frame's colour image to draw on (red first).
[[nodiscard]] cv::Mat picture_of(const RgbdFrame& frame);
/// Tints and outlines where ids > 0. @param ids empty, or of the picture's size.
void tint_masks(cv::Mat& picture, const GreyImage& ids);
void draw_points(cv::Mat& picture, const Features& features, const PointLabels& labels);
/// Boxes of the objects with id, class and speed; resting ones are drawn thin.
void draw_objects(cv::Mat& picture, std::span<const TrackedObject> objects);
/// White text on a dark bar at the lower edge.
void draw_caption(cv::Mat& picture, const std::string& text);
[[nodiscard]] Status write_jpeg(const std::filesystem::path& file, const cv::Mat& picture);

}  // namespace ygslam
