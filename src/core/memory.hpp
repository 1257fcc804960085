// Whether there is memory, asked before libraries that do not come back from want of it; and memory
// that is given back to the system.
#pragma once

#include <cstddef>
#include <string_view>

namespace ygslam {

/// So many bytes in one piece can be had at this moment. Nothing is kept, no page is touched.
[[nodiscard]] bool can_allocate(std::size_t bytes);

/// Throws std::bad_alloc unless can_allocate().
void require_memory(std::size_t bytes);

/// Gives back what the process holds of the code and constants of libraries whose file name has
/// this in it, and what malloc holds free: for after a start-up that needed far more of both than
/// what follows. A page that is needed again is mapped again, from the system's cache of files. It
/// is of the whole process, whoever else uses the library; malloc waits meanwhile.
void give_back_startup_memory(std::string_view library);

/// From now on all threads get their memory out of two arenas of malloc's, not of up to eight for
/// each core: each keeps free what its threads gave back, and others cannot have it. For programs,
/// before their threads start.
void share_free_memory();

/// Gives back what malloc holds free; it waits meanwhile.
void give_back_free_memory();

}  // namespace ygslam
