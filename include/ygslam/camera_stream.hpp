// Writes what a camera sees for `camera | ygslam run - --realtime`: an MCAP stream (mcap.dev) of
// ROS 2 messages. The same bytes in a file are a recording: `camera | tee room.mcap | ygslam run
// -`.
//
//   ygslam::CameraStream stream(stdout, {640, 480, 525, 525, 319.5, 239.5});
//   while (...) if (!stream.write(t_ns, rgb, depth_mm)) break;
//
// Needs the standard library only; little-endian machines. Nothing but the stream may be written to
// standard output. Who no longer reads ends the program by SIGPIPE, unless that is ignored: then
// write() says so.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

namespace ygslam {

/// Pinhole camera with plumb_bob distortion, as in OpenCV; of colour and of depth, which is
/// registered to it. [px]
struct StreamCamera {
  std::uint32_t width = 640, height = 480;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

class CameraStream {
 public:
  /// @param to stays open, and is flushed after every frame: `stdout`, a socket, a file.
  CameraStream(std::FILE* to, const StreamCamera& camera) : to_(to), camera_(camera) {
    static_assert(std::endian::native == std::endian::little, "numbers are written as they lie");
    std::string head("\x89MCAP0\r\n", 8);
    std::string header;
    text(header, "ros2");
    text(header, "ygslam::CameraStream");
    record(head, 0x01, header);
    const std::array<std::string_view, 3> types = {
        "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Image", "sensor_msgs/msg/Image"};
    const std::array<std::string_view, 3> topics = {"/camera/color/camera_info",
                                                    "/camera/color/image_raw",
                                                    "/camera/aligned_depth_to_color/image_raw"};
    for (std::uint16_t id = 1; id <= 3; ++id) {
      const std::uint16_t schema_id = id == 1 ? 1 : 2;
      std::string schema;
      number(schema, schema_id);
      text(schema, types[id - 1]);
      text(schema, "ros2msg");
      text(schema, id == 1 ? kCameraInfo : kImage);
      if (id <= 2) record(head, 0x03, schema);
      std::string channel;
      number(channel, id);
      number(channel, schema_id);
      text(channel, topics[id - 1]);
      text(channel, "cdr");
      number(channel, std::uint32_t{0});  // nothing further is said of it
      record(head, 0x04, channel);
    }
    put(head);
  }
  CameraStream(const CameraStream&) = delete;
  CameraStream& operator=(const CameraStream&) = delete;
  ~CameraStream() { finish(); }

  /// @param t_ns of the colour image, in the camera's clock or since 1970; increasing.
  /// @param rgb height x width x 3, r g b. @param depth_mm height x width, registered to rgb;
  /// 0 = none. @param depth_t_ns of the depth image, where it is another.
  /// @return false once it can no longer be written.
  bool write(std::int64_t t_ns, const std::uint8_t* rgb, const std::uint16_t* depth_mm,
             std::int64_t depth_t_ns = -1) {
    message(1, t_ns, camera_info(t_ns), nullptr, 0);
    image(3, depth_t_ns < 0 ? t_ns : depth_t_ns, "16UC1", 2, depth_mm);
    image(2, t_ns, "rgb8", 3, rgb);
    ok_ = ok_ && std::fflush(to_) == 0;
    return ok_;
  }
  /// The end of a whole recording; nothing may be written afterwards.
  bool finish() {
    if (has_ended_) return ok_;
    has_ended_ = true;
    std::string end;
    record(end, 0x0F, std::string(4, '\0'));   // no checksum
    record(end, 0x02, std::string(20, '\0'));  // no summary
    end += std::string("\x89MCAP0\r\n", 8);
    put(end);
    ok_ = ok_ && std::fflush(to_) == 0;
    return ok_;
  }

 private:
  template <typename T>
  static void number(std::string& to, T value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    to.append(bytes, sizeof value);
  }
  static void text(std::string& to, std::string_view text) {
    number(to, static_cast<std::uint32_t>(text.size()));
    to += text;
  }
  static void record(std::string& to, char opcode, const std::string& content) {
    to += opcode;
    number(to, static_cast<std::uint64_t>(content.size()));
    to += content;
  }

  // CDR: numbers at multiples of their size after a head of four bytes, texts with a zero.
  template <typename T>
  static void field(std::string& cdr, T value) {
    while ((cdr.size() - 4) % sizeof value != 0) cdr += '\0';
    number(cdr, value);
  }
  static void field(std::string& cdr, const char* value) {
    field(cdr, static_cast<std::uint32_t>(std::strlen(value) + 1));
    cdr.append(value, std::strlen(value) + 1);
  }
  static std::string message_head(std::int64_t t_ns) {
    std::string cdr("\0\1\0\0", 4);
    field(cdr, static_cast<std::int32_t>(t_ns / 1'000'000'000));
    field(cdr, static_cast<std::uint32_t>(t_ns % 1'000'000'000));
    field(cdr, "camera_color_optical_frame");
    return cdr;
  }
  [[nodiscard]] std::string camera_info(std::int64_t t_ns) const {
    const StreamCamera& c = camera_;
    std::string cdr = message_head(t_ns);
    field(cdr, c.height);
    field(cdr, c.width);
    field(cdr, "plumb_bob");
    field(cdr, std::uint32_t{5});
    for (const double term : {c.k1, c.k2, c.p1, c.p2, c.k3}) field(cdr, term);
    for (const double k : {c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0}) field(cdr, k);
    for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) field(cdr, r);
    for (const double p : {c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0})
      field(cdr, p);
    for (int i = 0; i < 6; ++i) field(cdr, std::uint32_t{0});  // neither binned nor cut
    field(cdr, std::uint8_t{0});
    return cdr;
  }
  void image(std::uint16_t channel, std::int64_t t_ns, const char* encoding,
             std::uint32_t pixel_bytes, const void* pixels) {
    std::string cdr = message_head(t_ns);
    field(cdr, camera_.height);
    field(cdr, camera_.width);
    field(cdr, encoding);
    field(cdr, std::uint8_t{0});  // little-endian
    field(cdr, camera_.width * pixel_bytes);
    const std::uint32_t bytes = camera_.width * camera_.height * pixel_bytes;
    field(cdr, bytes);
    message(channel, t_ns, cdr, pixels, bytes);
  }
  void message(std::uint16_t channel, std::int64_t t_ns, const std::string& cdr, const void* pixels,
               std::size_t bytes) {
    std::string head(1, '\x05');
    number(head, static_cast<std::uint64_t>(22 + cdr.size() + bytes));
    number(head, channel);
    number(head, counts_[channel - 1]++);
    number(head, t_ns);  // logged, published
    number(head, t_ns);
    put(head + cdr);
    ok_ = ok_ && std::fwrite(pixels == nullptr ? "" : pixels, 1, bytes, to_) == bytes;
  }
  void put(const std::string& bytes) {
    ok_ = ok_ && std::fwrite(bytes.data(), 1, bytes.size(), to_) == bytes.size();
  }

  static constexpr std::string_view kImage =
      "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
      "uint32 step\nuint8[] data\n"
      "================================================================================\n"
      "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
      "================================================================================\n"
      "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
  static constexpr std::string_view kCameraInfo =
      "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
      "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
      "sensor_msgs/RegionOfInterest roi\n"
      "================================================================================\n"
      "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\n"
      "uint32 width\nbool do_rectify\n"
      "================================================================================\n"
      "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
      "================================================================================\n"
      "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

  std::FILE* to_;
  StreamCamera camera_;
  std::array<std::uint32_t, 3> counts_{};
  bool ok_ = true, has_ended_ = false;
};

}  // namespace ygslam
