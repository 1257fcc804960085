// One function per reader of foreign files: hands it any bytes and checks what it makes of them.
// A broken promise throws (CHECK), which libFuzzer and the replaying test both take for a failure.
#pragma once

#include <string_view>

namespace ygslam::fuzz {

void settings(std::string_view bytes);
void calibration(std::string_view bytes);
void worlds(std::string_view bytes);
void lists(std::string_view bytes);
void trajectories(std::string_view bytes);
void png(std::string_view bytes);
void jpeg(std::string_view bytes);
void instances(std::string_view bytes);
void sweep(std::string_view bytes);
void map_file(std::string_view bytes);
void map_rows(std::string_view bytes);
void surface_ply(std::string_view bytes);
void objects(std::string_view bytes);
void live_requests(std::string_view bytes);
void bags(std::string_view bytes);
void messages(std::string_view bytes);
void image_files(std::string_view bytes);
void poses(std::string_view bytes);
void network_outputs(std::string_view bytes);
void inertial(std::string_view bytes);

}  // namespace ygslam::fuzz
