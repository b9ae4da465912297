#include "panonav_ros2/participant.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_ros2/internal/raw_topic.hpp"

namespace panonav::ros2 {

namespace {

int check_result(int result, const std::string& what) {
  if (result < 0) throw Error("DDS: " + what + ": " + dds_strretcode(result));
  return result;
}

std::string environment(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): at the start
  return value == nullptr ? "" : value;
}

int resolve_domain_number(const ParticipantOptions& options) {
  constexpr int max_domain = 232;  // the highest with UDP ports below 65536
  if (options.domain) return *options.domain;
  const std::string text = environment("ROS_DOMAIN_ID");
  if (text.empty()) return 0;
  const bool digits = std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
  const int domain = digits && text.size() <= 3 ? std::stoi(text) : -1;
  if (domain < 0 || domain > max_domain) {
    throw ContractError("ROS_DOMAIN_ID", to_readable_line(text), "0 .. 232");
  }
  return domain;
}

int gid_bytes(const ParticipantOptions& options) {
  constexpr int before_iron = 24;
  constexpr int since_iron = 16;
  if (options.gid_bytes) return *options.gid_bytes;
  const std::string distribution = environment("ROS_DISTRO");
  const std::array old{"foxy", "galactic", "humble"};
  return std::ranges::find(old, distribution) == old.end() ? since_iron : before_iron;
}

/// Returns the DDS name of a type: "sensor_msgs/Image" becomes sensor_msgs::msg::dds_::Image_,
/// "std_srvs/srv/Trigger_Request" std_srvs::srv::dds_::Trigger_Request_.
std::string dds_type_name(std::string_view type) {
  const std::size_t first = type.find('/');
  const std::size_t last = type.rfind('/');
  const auto kind = first == last ? "msg" : type.substr(first + 1, last - first - 1);
  return std::string(type.substr(0, first)) + "::" + std::string(kind) +
         "::dds_::" + std::string(type.substr(last + 1)) + "_";
}

/// Returns the DDS name of a topic; requests and replies of services have their own prefixes and
/// suffixes.
std::string dds_topic_name(const std::string& full, std::string_view type) {
  if (type.ends_with("_Request")) return "rq" + full + "Request";
  if (type.ends_with("_Response")) return "rr" + full + "Reply";
  return "rt" + full;
}

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using DdsQos = std::unique_ptr<dds_qos_t, QosDeleter>;

DdsQos make_dds_qos(const Qos& options) {
  // Use 99 ms instead of the default of 100 ms: default values are not announced, and some peers
  // (@foxglove/ros2) match only writers that announce their reliability.
  constexpr dds_duration_t max_blocking = DDS_MSECS(99);
  DdsQos qos(dds_create_qos());
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, options.depth);
  dds_qset_reliability(qos.get(),
                       options.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       max_blocking);
  dds_qset_durability(qos.get(), options.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL
                                                         : DDS_DURABILITY_VOLATILE);
  dds_qset_writer_data_lifecycle(qos.get(), false);
  return qos;
}

struct Unreference {
  void operator()(ddsi_serdata* sample) const { ddsi_serdata_unref(sample); }
};
using Sample = std::unique_ptr<ddsi_serdata, Unreference>;

class CdrWriter {
 public:
  void number(std::uint32_t value) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes.insert(bytes.end(), value.begin(), value.end());
    bytes.push_back(0);
  }
  std::vector<std::uint8_t> bytes{0, 1, 0, 0};
};

/// Configures a DDS domain for all participants of this process in it.
class Domain {
 public:
  Domain(int number, const std::optional<bool>& localhost_only) {
    const bool local = localhost_only.value_or(environment("ROS_LOCALHOST_ONLY") == "1");
    const std::string localhost_configuration =
        "<General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>";
    std::string configuration = "<CycloneDDS><Domain>" +
                                (local ? localhost_configuration : std::string()) +
                                "<Discovery><MaxAutoParticipantIndex>64</MaxAutoParticipantIndex>"
                                "</Discovery></Domain></CycloneDDS>";
    const std::string user_configuration = environment("CYCLONEDDS_URI");
    if (!user_configuration.empty()) configuration += "," + user_configuration;
    entity_ = dds_create_domain(static_cast<dds_domainid_t>(number), configuration.c_str());
    if (entity_ < 0) {
      throw Error("DDS: domain " + std::to_string(number) +
                  " cannot begin; allowed: a network interface that is up, and a CYCLONEDDS_URI "
                  "that Cyclone DDS understands");
    }
  }
  ~Domain() { dds_delete(entity_); }
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

 private:
  dds_entity_t entity_ = 0;
};

std::shared_ptr<const Domain> get_or_create_domain(int number,
                                                   const std::optional<bool>& localhost_only) {
  static std::mutex mutex;
  static std::map<int, std::weak_ptr<const Domain>> domains;
  const std::lock_guard lock(mutex);
  auto domain = domains[number].lock();
  if (!domain) {
    domain = std::make_shared<const Domain>(number, localhost_only);
    domains[number] = domain;
  }
  return domain;
}

}  // namespace

std::string full_name(std::string_view name, const ParticipantOptions& options) {
  const auto absolute = [&](std::string_view topic) {
    const std::string inside = options.name_space == "/" ? "" : options.name_space;
    std::string full(topic);
    if (full.starts_with('~')) {
      full = inside + "/" + options.node + full.substr(1);
    } else if (!full.starts_with('/')) {
      full = inside + "/" + full;
    }
    const bool legal = std::ranges::all_of(full, [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             c == '_' || c == '/';
    });
    bool after_slash = false;
    bool well_formed = legal && full.size() > 1 && !full.ends_with('/') && full.size() < 240;
    for (const char c : full) {
      if (after_slash && (c == '/' || (c >= '0' && c <= '9'))) well_formed = false;
      after_slash = c == '/';
    }
    if (!well_formed) {
      throw ContractError("name of a topic", to_readable_line(topic),
                          "letters, digits, _ and /, as camera/image or /camera/image");
    }
    return full;
  };
  const std::string plain = absolute(name);
  for (const auto& [from, to] : options.remappings) {
    if (absolute(from) == plain) return absolute(to);
  }
  return plain;
}

struct Participant::Implementation {
  struct Subscription {
    std::string topic;  // as passed by the caller
    dds_entity_t dds_topic = 0;
    dds_entity_t reader = 0;
    Qos qos;
    Receive receive;
  };

  Implementation(const ParticipantOptions& options_, Note note_)
      : options(options_), note(std::move(note_)) {
    (void)full_name("~/name", options);  // throws if node or namespace are not valid names
    const int number = resolve_domain_number(options);
    domain = get_or_create_domain(number, options.localhost_only);
    const DdsQos qos(dds_create_qos());
    const std::string enclave = "enclave=/;";
    dds_qset_userdata(qos.get(), enclave.data(), enclave.size());
    try {
      participant = check_result(
          dds_create_participant(static_cast<dds_domainid_t>(number), qos.get(), nullptr),
          "no participant in domain " + std::to_string(number));
      waitset = check_result(dds_create_waitset(participant), "waitset");
      guard = check_result(dds_create_guardcondition(participant), "guard condition");
      check_result(dds_waitset_attach(waitset, guard, -1), "guard condition");
      graph = make_writer("ros_discovery_info", "rmw_dds_common/ParticipantEntitiesInfo",
                          {.depth = 1, .reliable = true, .transient_local = true});
    } catch (...) {
      end();
      throw;
    }
  }
  ~Implementation() { end(); }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void end() const {
    if (participant > 0) dds_delete(participant);
  }

  [[nodiscard]] dds_entity_t make_topic(const std::string& name, std::string_view type) const {
    ddsi_sertype* raw = make_raw_type(dds_type_name(type));
    return check_result(
        dds_create_topic_sertype(participant, name.c_str(), &raw, nullptr, nullptr, nullptr),
        "topic " + name);
  }
  [[nodiscard]] dds_entity_t make_writer(const std::string& name, std::string_view type,
                                         const Qos& qos) const {
    return check_result(
        dds_create_writer(participant, make_topic(name, type), make_dds_qos(qos).get(), nullptr),
        "publisher of " + name);
  }
  void make_reader(std::size_t index) {
    Subscription& subscription = subscriptions[index];
    subscription.reader =
        check_result(dds_create_reader(participant, subscription.dds_topic,
                                       make_dds_qos(subscription.qos).get(), nullptr),
                     "subscription of " + subscription.topic);
    check_result(
        dds_set_status_mask(subscription.reader,
                            DDS_DATA_AVAILABLE_STATUS | DDS_REQUESTED_INCOMPATIBLE_QOS_STATUS),
        "status");
    check_result(dds_waitset_attach(waitset, subscription.reader, static_cast<dds_attach_t>(index)),
                 "subscription");
  }

  /// Announces the current endpoints to the ROS 2 graph.
  void announce() const {
    CdrWriter message;
    const auto gid = [&](dds_entity_t entity) {
      dds_guid_t guid{};
      check_result(dds_get_guid(entity, &guid), "guid");
      message.bytes.insert(message.bytes.end(), std::begin(guid.v), std::end(guid.v));
      message.bytes.resize(message.bytes.size() + gid_bytes(options) - sizeof guid.v);
    };
    gid(participant);
    message.number(1);
    message.text(options.name_space);
    message.text(options.node);
    message.number(static_cast<std::uint32_t>(subscriptions.size()));
    for (const Subscription& each : subscriptions) gid(each.reader);
    message.number(static_cast<std::uint32_t>(writers.size()));
    for (const dds_entity_t each : writers) gid(each);
    const std::span<const std::uint8_t> bytes = message.bytes;
    check_result(dds_write(graph, &bytes), "ros_discovery_info");
  }

  void receive_messages(const Subscription& subscription) {
    constexpr std::size_t max_batch = 16;
    std::array<ddsi_serdata*, max_batch> samples{};
    std::array<dds_sample_info_t, max_batch> infos{};
    for (int left = std::max(subscription.qos.depth, 1); left > 0;) {
      const int count = dds_takecdr(subscription.reader, samples.data(),
                                    static_cast<std::uint32_t>(std::min<int>(left, max_batch)),
                                    infos.data(), DDS_ANY_STATE);
      if (count <= 0) return;
      for (int i = 0; i < count; ++i) {
        const auto index = static_cast<std::size_t>(i);
        const Sample sample(samples[index]);
        if (infos[index].valid_data) subscription.receive(bytes_of(*sample));
      }
      left -= count;
    }
  }

  void handle_reader(std::size_t index) {
    Subscription& subscription = subscriptions[index];
    dds_requested_incompatible_qos_status_t refused{};
    dds_get_requested_incompatible_qos_status(subscription.reader, &refused);
    if (refused.total_count_change > 0) {
      if (refused.last_policy_id == DDS_RELIABILITY_QOS_POLICY_ID && subscription.qos.reliable) {
        subscription.qos.reliable = false;
        dds_waitset_detach(waitset, subscription.reader);
        dds_delete(subscription.reader);
        make_reader(index);
        announce();
        return;
      }
      note("a publisher of " + subscription.topic +
           " does not offer what is requested (QoS policy " +
           std::to_string(refused.last_policy_id) + "), and is not received");
    }
    receive_messages(subscription);
  }

  ParticipantOptions options;
  Note note;
  std::shared_ptr<const Domain> domain;
  dds_entity_t participant = 0;
  dds_entity_t waitset = 0;
  dds_entity_t guard = 0;
  dds_entity_t graph = 0;
  std::vector<Subscription> subscriptions;
  std::vector<dds_entity_t> writers;
  std::atomic<bool> stopped = false;
};

Participant::Participant(const ParticipantOptions& options, Note note)
    : implementation_(std::make_unique<Implementation>(options, std::move(note))) {}
Participant::~Participant() = default;

void Participant::subscribe(const std::string& topic, std::string_view type, const Qos& qos,
                            Receive receive) {
  auto& self = *implementation_;
  const std::string name = dds_topic_name(full_name(topic, self.options), type);
  self.subscriptions.push_back({topic, self.make_topic(name, type), 0, qos, std::move(receive)});
  self.make_reader(self.subscriptions.size() - 1);
  self.announce();
}

std::size_t Participant::publishers(const std::string& topic) const {
  std::size_t count = 0;
  for (const auto& each : implementation_->subscriptions) {
    if (each.topic != topic) continue;
    count += static_cast<std::size_t>(
        std::max(0, dds_get_matched_publications(each.reader, nullptr, 0)));
  }
  return count;
}

void Participant::Writer::write(std::span<const std::uint8_t> cdr) const {
  check_result(dds_write(entity_, &cdr), "a message was not taken");
}

std::size_t Participant::Writer::subscribers() const {
  return static_cast<std::size_t>(std::max(0, dds_get_matched_subscriptions(entity_, nullptr, 0)));
}

Participant::Writer Participant::advertise(const std::string& topic, std::string_view type,
                                           const Qos& qos) {
  auto& self = *implementation_;
  const std::string name = dds_topic_name(full_name(topic, self.options), type);
  self.writers.push_back(self.make_writer(name, type, qos));
  self.announce();
  return Writer(self.writers.back());
}

void Participant::wait(std::chrono::nanoseconds longest) {
  auto& self = *implementation_;
  std::vector<dds_attach_t> ready(self.subscriptions.size() + 1);
  const int count = check_result(dds_waitset_wait(self.waitset, ready.data(), ready.size(),
                                                  std::max<std::int64_t>(0, longest.count())),
                                 "waiting");
  for (int i = 0; i < std::min(count, static_cast<int>(ready.size())); ++i) {
    const dds_attach_t index = ready[static_cast<std::size_t>(i)];
    if (index >= 0) {
      self.handle_reader(static_cast<std::size_t>(index));
    } else {
      bool was = false;
      dds_take_guardcondition(self.guard, &was);
    }
  }
}

void Participant::run(std::chrono::duration<double> period_s, const std::function<void()>& tick) {
  using Steady = std::chrono::steady_clock;
  const auto period = std::chrono::duration_cast<Steady::duration>(period_s);
  auto next = Steady::now();
  while (!implementation_->stopped) {
    wait(std::max<Steady::duration>(next - Steady::now(), Steady::duration::zero()));
    const auto now = Steady::now();
    if (now < next) continue;
    next = std::max(next + period, now);
    tick();
  }
}

void Participant::stop() noexcept {
  implementation_->stopped = true;
  dds_set_guardcondition(implementation_->guard, true);
}

}  // namespace panonav::ros2
