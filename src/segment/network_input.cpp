#include "segment/network_input.hpp"

namespace ygslam {
namespace {

// ImageNet's, bytes; https://pytorch.org/vision/stable/models.html
constexpr std::array kMean{123.675F, 116.28F, 103.53F};
constexpr std::array kStd{58.395F, 57.12F, 57.375F};

}  // namespace

InputForm input_form(OutputKind kind) {
  switch (kind) {
    case OutputKind::kYolo:
    case OutputKind::kYoloEnd:
      return {Placement::kCentred, {}, 32};
    case OutputKind::kRtmdet:  // data_preprocessor, Resize and Pad of its configuration
      return {Placement::kTopLeft, {kMean, kStd, ChannelOrder::kBgr}, 32};
    case OutputKind::kRfdetr:  // https://rfdetr.roboflow.com/latest/exports/onnx
      break;
  }
  return {Placement::kStretched, {kMean, kStd, ChannelOrder::kRgb}, 1};
}

}  // namespace ygslam
