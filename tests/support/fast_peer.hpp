#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace panonav::ros2 {

/// A program of a user's on the other side of the wire: another vendor's DDS (Fast DDS), with types
/// by name whose samples are bytes of CDR.
class FastPeer {
 public:
  using Bytes = std::vector<std::uint8_t>;

  FastPeer();
  ~FastPeer();
  FastPeer(const FastPeer&) = delete;
  FastPeer& operator=(const FastPeer&) = delete;

  struct Endpoint;
  /// Names as they are on the wire: "rt/tf", "tf2_msgs::msg::dds_::TFMessage_".
  Endpoint& listen(const std::string& topic, const std::string& type, bool reliable = true,
                   bool transient_local = false);
  Endpoint& talk(const std::string& topic, const std::string& type, bool reliable = true,
                 bool transient_local = false);
  /// Whether somebody matches within the time.
  static bool matched(Endpoint& endpoint, std::chrono::milliseconds within);
  static bool write(Endpoint& endpoint, const Bytes& cdr);
  /// The next one that came and was not asked for yet; empty when none comes within the time.
  static Bytes next(Endpoint& endpoint, std::chrono::milliseconds within);
  static std::size_t waiting(Endpoint& endpoint);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// This process sees nothing but a loopback interface of its own from now on, with multicast. False
/// where the system does not allow it.
bool enter_own_network();

}  // namespace panonav::ros2
