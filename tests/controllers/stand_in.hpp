// A stand-in for the interfaces of ROS 2 that a controller uses: signatures of rclcpp, ros2_control and realtime_tools
// with the least behind them. HUMBLE chooses the signatures of that distribution, else of later ones.
#pragma once
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rclcpp
{
class Time {};
class Duration {};
class Logger {};
class QoS {};
class SystemDefaultsQoS : public QoS {};

class Parameter
{
public:
  using Value = std::variant<double, std::vector<double>, std::vector<std::string>>;
  explicit Parameter(Value value) : value_(std::move(value)) {}
  double as_double() const { return std::get<double>(value_); }
  std::vector<double> as_double_array() const { return std::get<std::vector<double>>(value_); }
  std::vector<std::string> as_string_array() const { return std::get<std::vector<std::string>>(value_); }
  template<typename T>
  T get_value() const { return std::get<T>(value_); }

private:
  Value value_;
};

template<typename MessageT>
class Subscription
{
public:
  using SharedPtr = std::shared_ptr<Subscription<MessageT>>;
};
}  // namespace rclcpp

#define RCLCPP_ERROR(logger, ...) ((void)(logger), std::fprintf(stderr, __VA_ARGS__), std::fputc('\n', stderr))
#define RCLCPP_WARN RCLCPP_ERROR

namespace trajectory_msgs::msg
{
struct JointTrajectoryPoint
{
  std::vector<double> positions, velocities, accelerations, effort;
};
}  // namespace trajectory_msgs::msg

namespace rclcpp_lifecycle
{
class State {};

class LifecycleNode
{
public:
  bool has_parameter(const std::string & name) const { return values.count(name) != 0; }
  template<typename T>
  T declare_parameter(const std::string & name, const T & default_value)
  {
    const auto given = overrides.find(name);
    const auto & value = given == overrides.end() ? rclcpp::Parameter::Value(default_value) : given->second;
    values.emplace(name, value);
    return std::get<T>(value);
  }
  rclcpp::Parameter get_parameter(const std::string & name) const
  {
    if (!has_parameter(name)) {
      throw std::runtime_error(name + " is not declared");
    }
    return rclcpp::Parameter(values.at(name));
  }
  rclcpp::Logger get_logger() const { return {}; }
  template<typename MessageT, typename CallbackT>
  typename rclcpp::Subscription<MessageT>::SharedPtr create_subscription(
    const std::string & topic, const rclcpp::QoS &, CallbackT && callback)
  {
    subscribed = topic;
    send = callback;
    return std::make_shared<rclcpp::Subscription<MessageT>>();
  }

  std::map<std::string, rclcpp::Parameter::Value> overrides, values;
  std::string subscribed;
  std::function<void(std::shared_ptr<trajectory_msgs::msg::JointTrajectoryPoint>)> send;
};

namespace node_interfaces
{
class LifecycleNodeInterface
{
public:
  enum class CallbackReturn : std::uint8_t { SUCCESS = 97, FAILURE = 98, ERROR = 99 };
  virtual CallbackReturn on_configure(const State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_activate(const State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_deactivate(const State &) { return CallbackReturn::SUCCESS; }
  virtual ~LifecycleNodeInterface() = default;
};
}  // namespace node_interfaces
}  // namespace rclcpp_lifecycle

namespace hardware_interface
{
class LoanedInterface
{
public:
  LoanedInterface(std::string name, double & value) : name_(std::move(name)), value_(&value) {}
  LoanedInterface(const LoanedInterface &) = delete;
  LoanedInterface(LoanedInterface &&) = default;
#ifdef HUMBLE
  const std::string get_name() const { return name_; }
  double get_value() const { return *value_; }
  void set_value(double value) { *value_ = value; }
#else
  const std::string & get_name() const { return name_; }
  template<typename T = double>
  [[nodiscard]] std::optional<T> get_optional(unsigned int = 10) const { return *value_; }
  template<typename T>
  [[nodiscard]] bool set_value(const T & value, unsigned int = 10)
  {
    *value_ = value;
    return true;
  }
#endif

private:
  std::string name_;
  double * value_;
};
using LoanedCommandInterface = LoanedInterface;
using LoanedStateInterface = LoanedInterface;
}  // namespace hardware_interface

namespace controller_interface
{
using CallbackReturn = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface::CallbackReturn;
enum class return_type : std::uint8_t { OK = 0, ERROR = 1 };
enum class interface_configuration_type : std::uint8_t { ALL = 0, INDIVIDUAL = 1, NONE = 2 };
struct InterfaceConfiguration
{
  interface_configuration_type type;
  std::vector<std::string> names = {};
};

class ControllerInterfaceBase : public rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface
{
public:
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual void assign_interfaces(
    std::vector<hardware_interface::LoanedCommandInterface> && command_interfaces,
    std::vector<hardware_interface::LoanedStateInterface> && state_interfaces)
  {
    command_interfaces_ = std::move(command_interfaces);
    state_interfaces_ = std::move(state_interfaces);
  }
  virtual CallbackReturn on_init() = 0;
  virtual return_type update(const rclcpp::Time & time, const rclcpp::Duration & period) = 0;
  virtual bool is_chainable() const = 0;
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() { return node_; }
  template<typename ParameterT>
  auto auto_declare(const std::string & name, const ParameterT & default_value)
  {
    return node_->declare_parameter<ParameterT>(name, default_value);
  }

protected:
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

private:
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ = std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};

class ControllerInterface : public ControllerInterfaceBase
{
public:
  bool is_chainable() const final { return false; }
};
}  // namespace controller_interface

namespace realtime_tools
{
template<class T>
class RealtimeBuffer
{
public:
  T * readFromRT()
  {
    std::unique_lock<std::mutex> guard(mutex_, std::try_to_lock);
    if (guard.owns_lock() && fresh_) {
      std::swap(real_time_, other_);
      fresh_ = false;
    }
    return real_time_.get();
  }
  void writeFromNonRT(const T & data)
  {
    std::lock_guard<std::mutex> guard(mutex_);
    *other_ = data;
    fresh_ = true;
  }
  void initRT(const T & data) { *other_ = *real_time_ = data; }

private:
  std::unique_ptr<T> real_time_ = std::make_unique<T>(), other_ = std::make_unique<T>();
  bool fresh_ = false;
  std::mutex mutex_;
};
}  // namespace realtime_tools

/// In place of pluginlib: a function that makes the controller.
#define PLUGINLIB_EXPORT_CLASS(Class, Base) \
  std::unique_ptr<Base> new_controller() { return std::make_unique<Class>(); }
