// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
//
// The loop of ros2_control's controller manager, with a person as its controller.
//
// Loads and activates the hardware of a robot description, then reads and writes it at a rate in
// Hz: hardware description.urdf 50. A line on standard input is the next command of the joint
// `substrate` in m, or `active` or `inactive` for the hardware. Each period is a line on standard
// output: command, position, speed and force. Ends with its input.
#include <atomic>
#include <chrono>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <thread>

#include <hardware_interface/resource_manager.hpp>
#include <lifecycle_msgs/msg/state.hpp>
#include <rclcpp/rclcpp.hpp>

using lifecycle_msgs::msg::State;

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  auto node = std::make_shared<rclcpp::Node>("hardware");
  auto executor = std::make_shared<rclcpp::executors::SingleThreadedExecutor>();
  executor->add_node(node);
  std::thread spinning([&] { executor->spin(); });

  hardware_interface::ResourceManagerParams given;
  std::ifstream file(argv[1]);
  given.robot_description.assign(std::istreambuf_iterator<char>(file), {});
  given.update_rate = std::stoi(argv[2]);
  given.clock = node->get_clock();
  given.logger = node->get_logger();
  given.executor = executor;
  given.activate_all = true;
  given.handle_exceptions = false;
  hardware_interface::ResourceManager hardware(given, true);
  hardware.import_joint_limiters(given.robot_description);

  std::atomic<double> wanted{std::numeric_limits<double>::quiet_NaN()};
  std::atomic<uint8_t> state{State::PRIMARY_STATE_ACTIVE};
  std::atomic<bool> ended{false};
  std::thread listening([&] {
    for (std::string line; std::getline(std::cin, line); ) {
      if (line == "active") {
        state = State::PRIMARY_STATE_ACTIVE;
      } else if (line == "inactive") {
        state = State::PRIMARY_STATE_INACTIVE;
      } else {
        wanted = std::stod(line);
      }
    }
    ended = true;
  });

  {
    auto command = hardware.claim_command_interface("substrate/position");
    auto position = hardware.claim_state_interface("substrate/position");
    auto speed = hardware.claim_state_interface("substrate/velocity");
    auto force = hardware.claim_state_interface("substrate/effort");
    const rclcpp::Duration period = rclcpp::Duration::from_seconds(1.0 / given.update_rate);
    uint8_t now = state;
    for (rclcpp::Rate rate(given.update_rate); !ended && rclcpp::ok(); rate.sleep()) {
      if (state != now) {
        now = state;
        const bool active = now == State::PRIMARY_STATE_ACTIVE;
        rclcpp_lifecycle::State target(now, active ? "active" : "inactive");
        hardware.set_component_state("mlmem_hardware", target);
      }
      hardware.read(node->now(), period);
      (void)command.set_value(wanted.load());
      hardware.enforce_command_limits(period);
      hardware.write(node->now(), period);
      std::cout << *command.get_optional() << ' ' << *position.get_optional() << ' ' <<
        *speed.get_optional() << ' ' << *force.get_optional() << std::endl;
    }
  }
  hardware.shutdown_components();
  executor->cancel();
  spinning.join();
  listening.join();
  rclcpp::shutdown();
}
