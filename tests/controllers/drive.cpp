// Drive a controller as the manager of ros2_control does. Arguments: parameters, as position_gains=1,2. Input: a line
// for each cycle, positions and velocities, and as many numbers of a goal as follow. Output: a line of efforts each.
#include <cstdlib>
#include <iostream>
#include <new>
#include <sstream>

#include "stand_in.hpp"

static long allocations = 0;
void * operator new(std::size_t size)
{
  ++allocations;
  return std::malloc(size);
}
void operator delete(void * pointer) noexcept { std::free(pointer); }
void operator delete(void * pointer, std::size_t) noexcept { std::free(pointer); }

std::unique_ptr<controller_interface::ControllerInterface> new_controller();

static std::vector<double> numbers(std::string text)
{
  std::vector<double> result;
  for (char & letter : text) {
    letter = letter == ',' ? ' ' : letter;
  }
  std::istringstream stream(text);
  for (std::string word; stream >> word;) {
    result.push_back(std::strtod(word.c_str(), nullptr));
  }
  return result;
}

int main(int count, char ** arguments)
{
  using controller_interface::CallbackReturn;
  auto controller = new_controller();
  auto node = controller->get_node();
  for (int k = 1; k < count; ++k) {
    const std::string text = arguments[k], name = text.substr(0, text.find('='));
    const auto values = numbers(text.substr(name.size() + 1));
    node->overrides.emplace(
      name, name.find("model.") == 0 ? rclcpp::Parameter::Value(values.at(0)) : rclcpp::Parameter::Value(values));
  }
  const rclcpp_lifecycle::State state;
  if (controller->on_init() != CallbackReturn::SUCCESS || controller->on_configure(state) != CallbackReturn::SUCCESS) {
    return 3;
  }
  const auto commands = controller->command_interface_configuration().names;
  const auto states = controller->state_interface_configuration().names;
  const std::size_t n = commands.size();
  std::vector<double> effort(n, 7.0), measured(2 * n);
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces;
  std::cout << node->subscribed;
  for (std::size_t i = 0; i < n; ++i) {
    command_interfaces.emplace_back(commands[i], effort[i]);
    std::cout << " " << commands[i];
  }
  for (std::size_t i = 0; i < 2 * n; ++i) {
    state_interfaces.emplace_back(states[i], measured[i]);
    std::cout << " " << states[i];
  }
  std::cout << "\n";
  controller->assign_interfaces(std::move(command_interfaces), std::move(state_interfaces));
  std::string line;
  long allocated = 0;
  for (bool active = false; std::getline(std::cin, line); active = true) {
    const auto row = numbers(line);
    for (std::size_t i = 0; i < n; ++i) {
      measured[2 * i] = row.at(i);
      measured[2 * i + 1] = row.at(n + i);
    }
    if (!active && controller->on_activate(state) != CallbackReturn::SUCCESS) {
      return 4;
    }
    if (row.size() > 2 * n) {
      auto point = std::make_shared<trajectory_msgs::msg::JointTrajectoryPoint>();
      const auto part = [&](std::size_t k) {
        return row.size() < (k + 1) * n ? std::vector<double>() :
               std::vector<double>(row.begin() + k * n, row.begin() + (k + 1) * n);
      };
      point->positions = part(2), point->velocities = part(3), point->accelerations = part(4);
      node->send(point);
    }
    allocations = 0;
    const auto status = controller->update(rclcpp::Time(), rclcpp::Duration());
    allocated += allocations;
    for (std::size_t i = 0; i < n; ++i) {
      std::printf("%.17g ", effort[i]);
    }
    std::printf("%d\n", static_cast<int>(status));
  }
  std::fflush(stdout);
  controller->on_deactivate(state);
  std::cout << "allocations " << allocated << ", efforts at the end " << effort[0] << "\n";
  return 0;
}
