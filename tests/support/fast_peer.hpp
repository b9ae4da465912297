#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panonav_recordings/ros_messages.hpp"

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
  Endpoint& talk(const std::string& topic, const std::string& type, bool reliable = true);
  /// Topics of messages, "tf" is "rt/tf" on the wire.
  template <class Message>
  Endpoint& listen(const std::string& topic, bool reliable = true, bool transient_local = false) {
    return listen("rt/" + topic, wire_type(Message::type), reliable, transient_local);
  }
  template <class Message>
  Endpoint& talk(const std::string& topic, bool reliable = true) {
    return talk("rt/" + topic, wire_type(Message::type), reliable);
  }
  /// True if each endpoint of this peer is matched by somebody within the time.
  bool all_matched(std::chrono::milliseconds within);
  static bool write(Endpoint& endpoint, const Bytes& cdr);
  template <class Message>
  static bool write(Endpoint& endpoint, const Message& message) {
    return write(endpoint, recordings::ros::write_message(message));
  }
  /// The next one that came and was not asked for yet; empty when none comes within the time.
  static Bytes next(Endpoint& endpoint, std::chrono::milliseconds within);
  static std::size_t waiting(Endpoint& endpoint);

 private:
  static std::string wire_type(std::string_view type) {  // "std_msgs::msg::dds_::String_"
    const std::size_t slash = type.find('/');
    return std::string(type.substr(0, slash)) +
           "::msg::dds_::" + std::string(type.substr(slash + 1)) + "_";
  }
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// This process sees nothing but a loopback interface of its own from now on, with multicast. False
/// where the system does not allow it.
bool enter_own_network();

}  // namespace panonav::ros2
