#include "firmware_host/followed_order.hpp"

#include <map>

namespace tactus::firmware {
namespace {

using interact::GameEvent;
using interact::GameEventKind;

template <typename IsImpact>
std::vector<FollowedOrder> follow(std::span<const GameEvent> log, GameEventKind beginning,
                                  IsImpact&& is_impact) {
  std::map<std::int32_t, FollowedOrder> orders;
  for (const GameEvent& event : log) {
    if (event.order_index < 0) continue;
    if (event.kind == beginning)
      orders.try_emplace(event.order_index,
                         FollowedOrder{static_cast<std::size_t>(event.order_index), &event, nullptr, false});
    const auto order = orders.find(event.order_index);
    if (order == orders.end() || order->second.impact != nullptr || !is_impact(event)) continue;
    if (event.other_body_index >= 0)
      order->second.met_body_first = true;
    else
      order->second.impact = &event;
  }
  std::vector<FollowedOrder> list;
  for (const auto& [index, order] : orders) list.push_back(order);
  return list;
}

}  // namespace

std::vector<FollowedOrder> follow_throws(std::span<const GameEvent> log) {
  return follow(log, GameEventKind::thrown, [](const GameEvent& event) {
    return event.kind == GameEventKind::contact || event.kind == GameEventKind::broke;
  });
}

std::vector<FollowedOrder> follow_shots(std::span<const GameEvent> log) {
  return follow(log, GameEventKind::shot,
                [](const GameEvent& event) { return event.kind == GameEventKind::hit; });
}

}  // namespace tactus::firmware
