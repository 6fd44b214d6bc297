// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
/// A client in C++ by typed actions: writes a level or word, tells how it goes, and reads it back.
///
///     ros2 run mlmem_cpp_client client 5

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>

#include "mlmem_interfaces/action/read.hpp"
#include "mlmem_interfaces/action/write.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_action/rclcpp_action.hpp"

using mlmem_interfaces::action::Read;
using mlmem_interfaces::action::Write;

/// The actions of one memory node; every call spins the robot's node until it is answered.
class Memory
{
public:
  explicit Memory(rclcpp::Node::SharedPtr node, const std::string & name = "mlmem")
  : node_(node),
    read_(rclcpp_action::create_client<Read>(node, name + "/read")),
    write_(rclcpp_action::create_client<Write>(node, name + "/write"))
  {
  }

  /// Return the content once it has been read from the element.
  Read::Result read() { return ask<Read>(read_, Read::Goal()); }

  /// Write a level or word, verified by an echo, and return how it went.
  Write::Result write(std::int64_t content)
  {
    Write::Goal goal;
    goal.content = content;  // whichever the element holds
    return ask<Write>(write_, goal);
  }

private:
  template<typename Action>
  typename Action::Result ask(
    const typename rclcpp_action::Client<Action>::SharedPtr & client,
    const typename Action::Goal & goal)
  {
    using namespace std::chrono_literals;
    if (!client->wait_for_action_server(5s)) {
      throw std::runtime_error("no memory node serves actions: build mlmem_interfaces for it");
    }
    typename rclcpp_action::Client<Action>::SendGoalOptions options;
    options.feedback_callback = [this](auto, const auto feedback) {
        RCLCPP_INFO_THROTTLE(
          node_->get_logger(), *node_->get_clock(), 200, "%s: %.0f %%",
          feedback->phase.c_str(), 100.0 * feedback->share);
      };
    const auto handle = wait(client->async_send_goal(goal, options), 5s);
    if (!handle) {
      throw std::runtime_error("the node has a goal with this id");
    }
    const auto result = *wait(client->async_get_result(handle), 60s).result;
    if (result.error_code != Action::Result::NONE) {  // refused: nothing has changed
      const bool refused = result.error_code == Action::Result::REFUSED;
      throw std::runtime_error((refused ? "refused: " : "failed: ") + result.error);
    }
    return result;
  }

  template<typename Future>
  auto wait(Future future, std::chrono::seconds most)
  {
    if (rclcpp::spin_until_future_complete(node_, future, most) !=
      rclcpp::FutureReturnCode::SUCCESS)
    {
      throw std::runtime_error("no answer in time: how it ends is not known");
    }
    return future.get();
  }

  rclcpp::Node::SharedPtr node_;
  rclcpp_action::Client<Read>::SharedPtr read_;
  rclcpp_action::Client<Write>::SharedPtr write_;
};

int main(int argc, char ** argv)
{
  const auto arguments = rclcpp::init_and_remove_ros_arguments(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("cpp_client");
  int status = EXIT_FAILURE;
  try {
    Memory memory(node);
    const auto written = memory.write(arguments.size() > 1 ? std::stoll(arguments[1]) : 5);
    RCLCPP_INFO(node->get_logger(), "written in %lu ticks", written.ticks);
    const auto read = memory.read();
    const bool is_word = read.word >= 0;  // a register has no level
    RCLCPP_INFO(
      node->get_logger(), "%s %ld", is_word ? "word" : "level", is_word ? read.word : read.level);
    status = EXIT_SUCCESS;
  } catch (const std::exception & error) {
    RCLCPP_ERROR(node->get_logger(), "%s", error.what());
  }
  rclcpp::shutdown();
  return status;
}
