#include "support/fast_peer.hpp"

#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

namespace panonav::ros2 {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

namespace {

class BytesType : public dds::TopicDataType {
 public:
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 4U << 20U;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<FastPeer::Bytes*>(data);
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = size_of(data);  // RTPS wants a multiple of four
    std::memset(payload->data + bytes.size(), 0, payload->length - bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<FastPeer::Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return size_of(data); };
  }
  static std::uint32_t size_of(void* data) {
    return static_cast<std::uint32_t>((static_cast<FastPeer::Bytes*>(data)->size() + 3) / 4 * 4);
  }
  void* createData() override { return new FastPeer::Bytes; }
  void deleteData(void* data) override { delete static_cast<FastPeer::Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

template <class EndpointQos>
EndpointQos make_qos(bool reliable, bool transient_local) {
  EndpointQos qos;
  qos.reliability().kind =
      reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().depth = 200;
  qos.endpoint().history_memory_policy =
      eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return qos;
}

}  // namespace

struct FastPeer::Endpoint : dds::DataReaderListener, dds::DataWriterListener {
  void on_data_available(dds::DataReader* reader) override {
    Bytes bytes;
    dds::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex);
      came.push_back(bytes);
      changed.notify_all();
    }
  }
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    set_matched(status.current_count);
  }
  void on_publication_matched(dds::DataWriter*,
                              const dds::PublicationMatchedStatus& status) override {
    set_matched(status.current_count);
  }
  void set_matched(int count) {
    const std::lock_guard lock(mutex);
    peers = count;
    changed.notify_all();
  }

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Bytes> came;
  int peers = 0;
  dds::Topic* topic = nullptr;
  dds::DataReader* reader = nullptr;
  dds::DataWriter* writer = nullptr;
};

struct FastPeer::Implementation {
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
  std::vector<std::unique_ptr<Endpoint>> endpoints;

  Endpoint& make(const std::string& topic, const std::string& type) {
    if (participant->find_type(type).empty()) {
      participant->register_type(dds::TypeSupport(new BytesType(type)));
    }
    auto endpoint = std::make_unique<Endpoint>();
    auto* const known = participant->lookup_topicdescription(topic);
    endpoint->topic = known != nullptr
                          ? static_cast<dds::Topic*>(known)
                          : participant->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT);
    endpoints.push_back(std::move(endpoint));
    return *endpoints.back();
  }
};

FastPeer::FastPeer() : implementation_(std::make_unique<Implementation>()) {
  dds::DomainParticipantQos qos;
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->sendBufferSize = udp->receiveBufferSize = 4U << 20U;
  qos.transport().user_transports.push_back(udp);
  const std::string enclave = "enclave=/;";
  qos.user_data().setValue({enclave.begin(), enclave.end()});
  auto& self = *implementation_;
  self.participant = dds::DomainParticipantFactory::get_instance()->create_participant(0, qos);
  self.publisher = self.participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  self.subscriber = self.participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

FastPeer::~FastPeer() {
  auto& self = *implementation_;
  self.participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(self.participant);
}

FastPeer::Endpoint& FastPeer::listen(const std::string& topic, const std::string& type,
                                     bool reliable, bool transient_local) {
  Endpoint& endpoint = implementation_->make(topic, type);
  const auto qos = make_qos<dds::DataReaderQos>(reliable, transient_local);
  endpoint.reader = implementation_->subscriber->create_datareader(endpoint.topic, qos, &endpoint);
  return endpoint;
}

FastPeer::Endpoint& FastPeer::talk(const std::string& topic, const std::string& type,
                                   bool reliable) {
  Endpoint& endpoint = implementation_->make(topic, type);
  auto qos = make_qos<dds::DataWriterQos>(reliable, false);
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  endpoint.writer = implementation_->publisher->create_datawriter(endpoint.topic, qos, &endpoint);
  return endpoint;
}

bool FastPeer::all_matched(std::chrono::milliseconds within) {
  return std::ranges::all_of(implementation_->endpoints, [&](const auto& endpoint) {
    std::unique_lock lock(endpoint->mutex);
    return endpoint->changed.wait_for(lock, within, [&] { return endpoint->peers > 0; });
  });
}

bool FastPeer::write(Endpoint& endpoint, const Bytes& cdr) {
  Bytes copy = cdr;
  return endpoint.writer->write(&copy);
}

FastPeer::Bytes FastPeer::next(Endpoint& endpoint, std::chrono::milliseconds within) {
  std::unique_lock lock(endpoint.mutex);
  if (!endpoint.changed.wait_for(lock, within, [&] { return !endpoint.came.empty(); })) return {};
  Bytes bytes = std::move(endpoint.came.front());
  endpoint.came.pop_front();
  return bytes;
}

std::size_t FastPeer::waiting(Endpoint& endpoint) {
  const std::lock_guard lock(endpoint.mutex);
  return endpoint.came.size();
}

bool enter_own_network() {
  if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  const int handle = socket(AF_INET, SOCK_DGRAM, 0);
  if (handle < 0) return false;
  ifreq interface {};
  std::strcpy(interface.ifr_name, "lo");
  bool done = ioctl(handle, SIOCGIFFLAGS, &interface) == 0;
  interface.ifr_flags = static_cast<short>(interface.ifr_flags | IFF_UP | IFF_MULTICAST);
  done = done && ioctl(handle, SIOCSIFFLAGS, &interface) == 0;
  rtentry route{};
  const auto address = [](sockaddr& to, std::uint32_t host) {
    auto& inet = reinterpret_cast<sockaddr_in&>(to);
    inet.sin_family = AF_INET;
    inet.sin_addr.s_addr = htonl(host);
  };
  address(route.rt_dst, 0xE0000000U);      // 224.0.0.0
  address(route.rt_genmask, 0xF0000000U);  // /4
  address(route.rt_gateway, 0);
  route.rt_flags = RTF_UP;
  std::string device = "lo";
  route.rt_dev = device.data();
  done = done && ioctl(handle, SIOCADDRT, &route) == 0;
  close(handle);
  return done;
}

}  // namespace panonav::ros2
