#include "io/piece_file.hpp"

namespace ygslam {

Result<PieceFile> PieceFile::create(const std::filesystem::path& target) {
  auto file = AtomicFile::create(target);
  if (!file.ok()) return file.error();
  return PieceFile(std::move(*file));
}

void PieceFile::add(std::string_view bytes) {
  constexpr std::size_t kPiece_bytes = 1 << 20;
  piece_ += bytes;
  size_ += bytes.size();
  if (piece_.size() >= kPiece_bytes) flush();
}

void PieceFile::flush() {
  if (status_.ok()) status_ = file_.write(piece_);
  piece_.clear();
}

Status PieceFile::commit() {
  flush();
  return status_.ok() ? file_.commit() : status_;
}

}  // namespace ygslam
