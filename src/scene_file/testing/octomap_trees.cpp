#include "scene_file/testing/octomap_trees.hpp"

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <ostream>
#include <streambuf>

namespace ygslam::testing::octomap_trees {
namespace {

class SinkBuffer : public std::streambuf {
 public:
  explicit SinkBuffer(const ByteSink& sink) : sink_(sink) {}

 private:
  std::streamsize xsputn(const char* bytes, std::streamsize count) override {
    sink_({bytes, static_cast<std::size_t>(count)});
    return count;
  }
  int_type overflow(int_type byte) override {
    const char value = traits_type::to_char_type(byte);
    sink_({&value, 1});
    return byte;
  }

  const ByteSink& sink_;
};

template <typename Tree, typename Set, typename Write>
void write_tree(double cell_m, const LeafSource& leaves, const ByteSink& sink, Set set,
                Write write) {
  Tree tree(cell_m);
  Leaf leaf;
  constexpr bool kLazily = true;  // inner nodes follow once all leaves are there
  while (leaves(leaf)) {
    const octomap::OcTreeKey key(leaf.key[0], leaf.key[1], leaf.key[2]);
    set(*tree.setNodeValue(key, leaf.log_odds, kLazily), leaf);
  }
  if (tree.size() > 0) tree.updateInnerOccupancy();  // which looks at the root unasked
  SinkBuffer buffer(sink);
  std::ostream stream(&buffer);
  stream.imbue(std::locale::classic());
  stream.precision(15);
  write(tree, stream);
}

// As the trees' own write() and writeBinary() do it, which print to the terminal, too.
template <typename Tree>
void write_header(const char* kind, const Tree& tree, std::ostream& stream) {
  stream << "# Octomap OcTree " << kind
         << "file\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
         << "id " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
         << tree.getResolution() << "\ndata\n";
}

}  // namespace

void write_bt(double cell_m, const LeafSource& leaves, const ByteSink& sink) {
  write_tree<octomap::OcTree>(
      cell_m, leaves, sink, [](octomap::OcTreeNode&, const Leaf&) {},
      [](octomap::OcTree& tree, std::ostream& stream) {
        tree.toMaxLikelihood();
        tree.prune();
        write_header("binary ", tree, stream);
        tree.writeBinaryData(stream);
      });
}

void write_ot(double cell_m, const LeafSource& leaves, const ByteSink& sink) {
  write_tree<octomap::ColorOcTree>(
      cell_m, leaves, sink,
      [](octomap::ColorOcTreeNode& node, const Leaf& leaf) {
        if (leaf.coloured) node.setColor(leaf.rgb[0], leaf.rgb[1], leaf.rgb[2]);
      },
      [](octomap::ColorOcTree& tree, std::ostream& stream) {
        write_header("", tree, stream);
        tree.writeData(stream);
      });
}

}  // namespace ygslam::testing::octomap_trees
