// Whether there is memory, asked before libraries that do not come back from want of it.
#pragma once

#include <cstddef>

namespace ygslam {

/// So many bytes in one piece can be had at this moment. Nothing is kept, no page is touched.
[[nodiscard]] bool can_allocate(std::size_t bytes);

/// Throws std::bad_alloc unless can_allocate().
void require_memory(std::size_t bytes);

}  // namespace ygslam
