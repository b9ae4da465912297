#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/ros_messages.hpp"
#include "ros2/warning_log.hpp"

namespace panonav::ros2 {

/// How samples are handed on, in the words of ROS 2. Histories are keep-last.
struct Qos {
  int depth = 5;
  bool reliable = true;
  /// What was written last reaches those who come later.
  bool transient_local = false;
};

struct ParticipantOptions {
  std::string node = "panonav";
  std::string name_space = "/";
  std::map<std::string, std::string> remappings;  ///< of names of topics and services
  /// Empty: as the environment says, ROS_DOMAIN_ID and ROS_LOCALHOST_ONLY.
  std::optional<int> domain;
  std::optional<bool> localhost_only;
  /// Of the graph's messages: 24 in Humble and before, 16 later. Empty: as ROS_DISTRO says, 16
  /// where it says nothing.
  std::optional<int> gid_bytes;
};

/// The full name of a topic or service: relative names are in the namespace, those after ~ in that
/// of the node; then remappings count. Throws ContractError on what is no name in ROS 2.
[[nodiscard]] std::string full_name(std::string_view name, const ParticipantOptions& options);

/// A node on a ROS 2 graph: topics by name and message type over DDS, seen by `ros2 node list`.
/// Messages are bytes of CDR here; a callback has to bear with any, and throws nothing. Writing may
/// happen on any thread, all else on one.
class Participant {
 public:
  using Receive = std::function<void(std::span<const std::uint8_t> cdr)>;

  /// `note` reports peers that offer less than was requested. Throws Error when DDS cannot begin.
  Participant(const ParticipantOptions& options, Note note);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// Messages come out of `wait`. `type` as "sensor_msgs/Image". A reliable subscription becomes a
  /// best-effort one as soon as a publisher offers no more: then it hears both kinds.
  void subscribe(const std::string& topic, std::string_view type, const Qos& qos, Receive receive);
  /// Publishers of a subscribed topic that match now.
  [[nodiscard]] std::size_t publishers(const std::string& topic) const;

  class Writer {
   public:
    /// Throws Error when DDS does not take it, as on a reliable peer that is far behind.
    void write(std::span<const std::uint8_t> cdr) const;
    [[nodiscard]] std::size_t subscribers() const;

   private:
    friend class Participant;
    explicit Writer(std::int32_t entity) : entity_(entity) {}
    std::int32_t entity_;
  };
  [[nodiscard]] Writer advertise(const std::string& topic, std::string_view type, const Qos& qos);

  /// Waits for messages and hands on those that are there, at most `Qos::depth` a topic, to the
  /// callbacks. Returns at the latest after `longest`, or once `stop` was called.
  void wait(std::chrono::nanoseconds longest);
  /// Waits for messages until `stop` is called, and calls `tick` once in each period.
  void run(std::chrono::duration<double> period_s, const std::function<void()>& tick);
  /// From any thread; for good.
  void stop() noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Messages of one type on one topic.
template <class Message>
class Publisher {
 public:
  Publisher(Participant& participant, const std::string& topic, const Qos& qos = {})
      : writer_(participant.advertise(topic, Message::type, qos)) {}
  void publish(const Message& message) const { writer_.write(ros::write_message(message)); }
  [[nodiscard]] std::size_t subscribers() const { return writer_.subscribers(); }

 private:
  Participant::Writer writer_;
};

/// Subscribes to messages of one type: `use` takes each, and its bytes if it wants them. Bytes that
/// are no such message, and errors that `use` throws, become warnings with the topic in front.
template <class Message, class Use>
void subscribe(Participant& participant, WarningLog& log, const std::string& topic, const Qos& qos,
               Use use) {
  participant.subscribe(
      topic, Message::type, qos, [&log, topic, use](std::span<const std::uint8_t> cdr) {
        try {
          const auto message = ros::read_message<Message>(cdr, MessageEncoding::cdr);
          if constexpr (std::is_invocable_v<Use, const Message&>) {
            use(message);
          } else {
            use(message, cdr);
          }
        } catch (const Error& error) {
          log.warn(topic, topic + ": " + readable_line(error.what()));
        }
      });
}

}  // namespace panonav::ros2
