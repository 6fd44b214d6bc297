# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every ROS 2 node may be given: qualities of service, and introspection of services."""

from rclpy.qos import qos_profile_system_default
from robot import Robot
from service_msgs.msg import ServiceEventInfo
from std_srvs.srv import Trigger


def test_qos_overrides_of_a_publisher_and_a_subscription_apply(start):
    start({
        'qos_overrides./mlmem/field.publisher.depth': 7,
        'qos_overrides./mlmem/field.publisher.reliability': 'best_effort',
        'qos_overrides./mlmem/probe.subscription.depth': 9,
    })  # fmt: skip
    with Robot() as robot:
        assert robot.get('qos_overrides./mlmem/probe.subscription.depth') == 9
        robot.wait(lambda: robot.node.count_publishers('/mlmem/field'), 'the publisher')
        (field,) = robot.node.get_publishers_info_by_topic('/mlmem/field')
    assert field.qos_profile.reliability.name == 'BEST_EFFORT'


def test_service_introspection_publishes_requests_and_answers(start):
    start()
    with Robot() as robot:
        events = []
        robot.node.create_subscription(
            Trigger.Event, '/mlmem/read/_service_event', events.append, qos_profile_system_default
        )
        robot.trigger('read')
        assert not events
        robot.set(service_configure_introspection='contents')
        robot.wait(
            lambda: robot.node.count_publishers('/mlmem/read/_service_event'), 'a publisher'
        )
        robot.trigger('read')
        kinds = ServiceEventInfo.REQUEST_RECEIVED, ServiceEventInfo.RESPONSE_SENT
        robot.wait(lambda: {each.info.event_type for each in events} >= set(kinds), 'both events')
        assert [each.response[0].success for each in events if each.response] == [True]
