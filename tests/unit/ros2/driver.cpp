// A node of ROS 2 in C++ on Fast DDS, the middleware of rmw_fastrtps: each odom of a robot is answered with a speed, and told on
// standard output. The messages are written and read by hand from the definitions of nav_msgs, sensor_msgs and geometry_msgs.
// Usage: driver DOMAIN NAMESPACE SPEED [torn]; torn commands consist of one byte.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <unistd.h>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;

struct Header {
  int32_t sec = 0;
  uint32_t nanosec = 0;
  std::string frame_id;
  void read(Cdr& cdr) { cdr >> sec >> nanosec >> frame_id; }
};

struct Odometry {
  Header header;
  std::string child_frame_id;
  std::array<double, 7> pose;
  std::array<double, 6> twist;
  std::array<double, 36> pose_covariance, twist_covariance;
  void read(Cdr& cdr) {
    header.read(cdr);
    cdr >> child_frame_id >> pose >> pose_covariance >> twist >> twist_covariance;
  }
  void write(Cdr&) const {}
};

struct LaserScan {
  Header header;
  std::array<float, 7> limits;
  std::vector<float> ranges, intensities;
  void read(Cdr& cdr) {
    header.read(cdr);
    cdr >> limits >> ranges >> intensities;
  }
  void write(Cdr&) const {}
};

struct Twist {
  std::array<double, 6> values{};
  bool is_torn = false;
  void read(Cdr& cdr) { cdr >> values; }
  void write(Cdr& cdr) const {
    if (is_torn)
      cdr << char(7);
    else
      cdr << values;
  }
};

// How Fast DDS handles a message, in plain little-endian CDR.
template <class Message>
class Type : public fast::TopicDataType {
 public:
  explicit Type(const char* name) {
    setName(name);
    m_typeSize = 1 << 16;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    static_cast<const Message*>(data)->write(cdr);
    payload->length = static_cast<uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    static_cast<Message*>(data)->read(cdr);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 1u << 16; };
  }
  void* createData() override { return new Message; }
  void deleteData(void* data) override { delete static_cast<Message*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

template <class Message, class Handler>
class Listener : public fast::DataReaderListener {
 public:
  explicit Listener(Handler handler) : handler_(handler) {}
  void on_data_available(fast::DataReader* reader) override {
    Message message;
    fast::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) handler_(message);
  }

 private:
  Handler handler_;
};

// Only on the loopback interface, where up to ten participants are looked for.
fast::DomainParticipantQos on_loopback(int domain) {
  fast::DomainParticipantQos qos = fast::PARTICIPANT_QOS_DEFAULT;
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.push_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  for (int i = 0; i < 10; ++i) {
    rtps::Locator_t locator;
    rtps::IPLocator::setIPv4(locator, 127, 0, 0, 1);
    locator.port = 7410 + 250 * domain + 2 * i;
    qos.wire_protocol().builtin.initialPeersList.push_back(locator);
  }
  rtps::Locator_t here;
  rtps::IPLocator::setIPv4(here, 127, 0, 0, 1);
  qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(here);
  return qos;
}

int main(int argc, char** argv) {
  const int domain = std::atoi(argv[1]);
  const std::string name = std::string("rt/") + argv[2] + "/";
  Twist command;
  command.values[0] = std::atof(argv[3]);
  command.is_torn = argc > 4;

  auto* participant =
      fast::DomainParticipantFactory::get_instance()->create_participant(domain, on_loopback(domain));
  if (!participant) return 1;
  fast::TypeSupport odometry(new Type<Odometry>("nav_msgs::msg::dds_::Odometry_"));
  fast::TypeSupport scan(new Type<LaserScan>("sensor_msgs::msg::dds_::LaserScan_"));
  fast::TypeSupport twist(new Type<Twist>("geometry_msgs::msg::dds_::Twist_"));
  for (auto* type : {&odometry, &scan, &twist}) type->register_type(participant);
  auto* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  auto topic = [&](const char* last, const fast::TypeSupport& type) {
    return participant->create_topic(name + last, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  };

  auto* writer = publisher->create_datawriter(topic("cmd_vel", twist), fast::DATAWRITER_QOS_DEFAULT);
  auto on_odometry = [&](const Odometry& message) {
    const auto& at = message.pose;
    std::printf("odom %.17g %.17g %.17g %d %u %s %s\n", at[0], at[1], at[2], message.header.sec,
                message.header.nanosec, message.header.frame_id.c_str(), message.child_frame_id.c_str());
    std::fflush(stdout);
    writer->write(&command);
  };
  auto on_scan = [](const LaserScan& message) {
    std::printf("scan %zu %.9g %.9g %s\n", message.ranges.size(), message.limits[0], message.limits[6],
                message.header.frame_id.c_str());
    std::fflush(stdout);
  };
  Listener<Odometry, decltype(on_odometry)> odometry_listener(on_odometry);
  Listener<LaserScan, decltype(on_scan)> scan_listener(on_scan);
  fast::DataReaderQos reliable = fast::DATAREADER_QOS_DEFAULT, best_effort = fast::DATAREADER_QOS_DEFAULT;
  reliable.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  reliable.history().depth = 10;
  subscriber->create_datareader(topic("odom", odometry), reliable, &odometry_listener);
  subscriber->create_datareader(topic("base_scan", scan), best_effort, &scan_listener);
  char rest;
  while (read(0, &rest, 1) > 0) {
  }
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
}
