#include "app/run_page.hpp"

#include <cstdio>

namespace ygslam {

Result<std::unique_ptr<RunView>> start_page(const RunOptions& o, const CameraConfig& camera) {
  auto config = parse_view_address(*o.view);
  if (!config.ok()) return config.error();
  constexpr const char* kOfTokens =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";  // as in addresses
  if (o.view_token.find_first_not_of(kOfTokens) != std::string::npos)
    return Error{ErrorKind::kUsage, "--view-token: letters, digits and -._~ only"};
  config->token = o.view_token;
  config->origins = o.view_origins;
  auto view = RunView::start({*config, camera, o.realtime, !o.save_map.empty(), o.view_paused});
  if (!view.ok()) return view.error();
  std::fprintf(stderr, "look at %s\n", (*view)->url().c_str());
  return view;
}

}  // namespace ygslam
