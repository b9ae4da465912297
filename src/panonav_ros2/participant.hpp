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
#include "panonav_recordings/ros_messages.hpp"
#include "panonav_ros2/warning_log.hpp"

namespace panonav::ros2 {

/// Quality of service of a topic, in the terms of ROS 2; the history is keep-last of `depth`.
struct Qos {
  int depth = 5;
  bool reliable = true;
  /// Later subscribers receive the last message.
  bool transient_local = false;
};

struct ParticipantOptions {
  std::string node = "panonav";
  std::string name_space = "/";
  std::map<std::string, std::string> remappings;  ///< of topic and service names
  std::optional<int> domain;                      ///< `nullopt`: ROS_DOMAIN_ID, or 0
  std::optional<bool> localhost_only;             ///< `nullopt`: by ROS_LOCALHOST_ONLY
  /// Length of ids in messages about the graph: 24 up to Humble, 16 later. `nullopt`: by
  /// ROS_DISTRO, 16 if it is not set.
  std::optional<int> gid_bytes;
};

/// Returns the full name of a topic or service: relative names are in the namespace, names that
/// begin with ~ in that of the node; then remappings apply. Throws ContractError on an invalid
/// name.
[[nodiscard]] std::string full_name(std::string_view name, const ParticipantOptions& options);

/// A node on a ROS 2 graph, listed by `ros2 node list`, with topics by name and message type over
/// DDS. Messages are CDR bytes; callbacks must accept any bytes and not throw. Any thread may
/// write; everything else happens on one thread.
class Participant {
 public:
  using Receive = std::function<void(std::span<const std::uint8_t> cdr)>;

  /// `note` reports publishers whose quality of service is not compatible. Throws Error if DDS
  /// cannot start.
  Participant(const ParticipantOptions& options, Note note);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// Calls `receive` for each message, from `wait`. `type` as "sensor_msgs/Image". If a publisher
  /// offers only best effort, a reliable subscription becomes best effort, which receives from both
  /// kinds.
  void subscribe(const std::string& topic, std::string_view type, const Qos& qos, Receive receive);
  /// Returns the number of publishers that currently match a subscribed topic.
  [[nodiscard]] std::size_t publishers(const std::string& topic) const;

  class Writer {
   public:
    /// Throws Error if DDS does not accept the message, for example because a reliable subscriber
    /// is far behind.
    void write(std::span<const std::uint8_t> cdr) const;
    [[nodiscard]] std::size_t subscribers() const;

   private:
    friend class Participant;
    explicit Writer(std::int32_t entity) : entity_(entity) {}
    std::int32_t entity_;
  };
  [[nodiscard]] Writer advertise(const std::string& topic, std::string_view type, const Qos& qos);

  /// Waits for messages and passes the received ones, at most `Qos::depth` per topic, to the
  /// callbacks. Returns after `longest` at the latest, or when `stop` is called.
  void wait(std::chrono::nanoseconds longest);
  /// Waits for messages until `stop` is called, and calls `tick` once per period.
  void run(std::chrono::duration<double> period_s, const std::function<void()>& tick);
  /// Ends `run` permanently. May be called from any thread.
  void stop() noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Publishes messages of one type on one topic.
template <class Message>
class Publisher {
 public:
  Publisher(Participant& participant, const std::string& topic, const Qos& qos = {})
      : writer_(participant.advertise(topic, Message::type, qos)) {}
  void publish(const Message& message) const {
    writer_.write(recordings::ros::write_message(message));
  }
  [[nodiscard]] std::size_t subscribers() const { return writer_.subscribers(); }

 private:
  Participant::Writer writer_;
};

/// Subscribes to messages of one type. `use` is called with each message, and with its bytes if it
/// has a second parameter. Bytes that cannot be decoded, and errors that `use` throws, become
/// warnings that name the topic.
template <class Message, class Use>
void subscribe(Participant& participant, WarningLog& log, const std::string& topic, const Qos& qos,
               Use use) {
  participant.subscribe(
      topic, Message::type, qos, [&log, topic, use](std::span<const std::uint8_t> cdr) {
        try {
          const auto message =
              recordings::ros::read_message<Message>(cdr, recordings::MessageEncoding::cdr);
          if constexpr (std::is_invocable_v<Use, const Message&>) {
            use(message);
          } else {
            use(message, cdr);
          }
        } catch (const Error& error) {
          log.warn(topic, topic + ": " + to_readable_line(error.what()));
        }
      });
}

}  // namespace panonav::ros2
