// From the people network's answer to instances and masks of the recorded image.
#pragma once

#include <span>
#include <vector>

#include "segment/people_input.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

struct DecodedPeople {
  std::vector<Instance> instances;  ///< of class person, the largest first
  GreyImage ids;                    ///< of the image's size; see Segmentation::ids
};

/// A cell shows somebody where its logit is positive. Cells side by side are of one person where
/// their depths differ by less than 15 cm or one of them has none. Parts that fit into one body
/// (one above the other, or a limb before or beside it) are one person. Where depth fails (hardly
/// any is measured, or a hole has straight edges) nobody is shown. The score is the mean
/// probability, less for what shows too little of a body to be one.
/// @param logits kPeopleRows x kPeopleColumns, finite. @param cells_m depth of the cells.
/// @param focal_cells of the camera of the grid.
[[nodiscard]] DecodedPeople decode_people(std::span<const float> logits, const DepthImage& cells_m,
                                          const PeopleGrid& grid, float focal_cells,
                                          int image_width, int image_height);

}  // namespace ygslam
