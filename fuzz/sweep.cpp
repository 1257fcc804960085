#include "benchmark_runs/run_record.hpp"
#include "benchmark_runs/sweep_file.hpp"
#include "core/check.hpp"
#include "fuzz/targets.hpp"

namespace ygslam::fuzz {
namespace {

void run_record(std::string_view bytes) {
  const auto record = parse_run_record(bytes, "run.json");
  if (!record.ok()) return;
  const auto text = to_json(*record).dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto again = parse_run_record(text, "run.json");
  CHECK(again.ok(), again.ok() ? "" : again.error().message.c_str());
}

}  // namespace

void sweep(std::string_view bytes) {
  run_record(bytes);
  const auto file = parse_sweep_file(bytes, "sweep.json");
  if (!file.ok()) return;
  // What was accepted can be gone on with: the file of the next call is one as well.
  SweepOptions options;
  options.modes = {"off", "full"};
  const auto next = sweep_json(options, comparable_options(options), {}, SweepFacts{}, file->json);
  (void)asked_runs(next);
  const auto text = next.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto again = parse_sweep_file(text, "sweep.json");
  CHECK(again.ok(), again.ok() ? "" : again.error().message.c_str());
}

}  // namespace ygslam::fuzz
