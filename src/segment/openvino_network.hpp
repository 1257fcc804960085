// What the networks that OpenVINO runs have in common. Internal to this folder.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "segment/precision.hpp"

namespace ov {
class InferRequest;
class Model;
}  // namespace ov

namespace ygslam {

/// What OpenVINO throws where less can be had is taken for want of memory, whose texts are many.
inline constexpr std::size_t kAmpleMemory_bytes = std::size_t{256} << 20;

/// Makes OpenVINO's report, several lines with source positions, one line that says what is wrong.
[[nodiscard]] std::string fault_in(const std::string& report);

/// Has FakeQuantize operations: made for int8.
[[nodiscard]] bool is_quantised(const ov::Model& network);

/// The precision to run at, never kAuto. @param name of the network, for messages. @return kConfig.
[[nodiscard]] Result<Precision> choose_precision(Precision wanted, bool is_quantised,
                                                 const std::string& name);

[[nodiscard]] std::string name_of(Precision precision);

/// Compiles a network for the processor, and gives back what only compiling took: best where
/// nobody else holds the network. @return kModel. Throws std::bad_alloc.
[[nodiscard]] Result<ov::InferRequest> compile_network(std::shared_ptr<ov::Model> network,
                                                       Precision precision, int threads,
                                                       const std::string& name);

}  // namespace ygslam
