// A bounded queue of messages of several types, each with its own overflow policy. Not thread-safe: a Cell locks it.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "actors/runtime/overflow.hpp"

namespace darm::runtime {

/// The unqualified name of a message type, for logs and metrics: "ShadeTiles".
template <class M>
[[nodiscard]] constexpr std::string_view message_name() {
  constexpr std::string_view pretty = __PRETTY_FUNCTION__;  // "... [with M = darm::x::Name; ...]" or "... [M = ...]"
  constexpr auto begin = pretty.find("M = ") + 4;
  constexpr auto end = pretty.find_first_of(";]", begin);
  constexpr std::string_view full = pretty.substr(begin, end - begin);
  constexpr auto colon = full.rfind(':');
  return colon == std::string_view::npos ? full : full.substr(colon + 1);
}

/// A type that may travel in a mailbox: names its overflow policy, and its key where the policy needs one.
template <class M>
concept Message = requires {
  { M::kOverflow } -> std::convertible_to<Overflow>;
} && (M::kOverflow != Overflow::kLatestByKey || requires(const M& m) {
                    { m.key() } -> std::convertible_to<std::uint64_t>;
                  });

/// What became of a pushed message.
enum class Delivery : std::uint8_t {
  kQueued,      ///< waits
  kReplaced,    ///< took the place of an older one of its type and key, which is dropped
  kMadeRoom,    ///< waits; the oldest one of its type was dropped for it
  kRefusedFull  ///< not taken
};

template <class Inbox>
class Mailbox;

template <class... Ms>
class Mailbox<std::variant<Ms...>> {
 public:
  using Inbox = std::variant<Ms...>;
  static_assert(
      (Message<Ms> && ...),
      "every message type needs `static constexpr auto kOverflow = Overflow::...;` and, for kLatestByKey, key()");

  /// Holds at most max(1, capacity) messages; those of kLatestOnly (one per type) do not count.
  explicit Mailbox(std::size_t capacity) : capacity_(capacity == 0 ? 1 : capacity) {}

  /// Takes `message` or, refused, leaves it untouched. A message dropped for it is moved into `displaced`, to be
  /// destroyed by the caller outside of its lock.
  template <class M>
    requires(!std::is_reference_v<M>)
  Delivery push(M&& message, std::optional<Inbox>& displaced) {
    constexpr std::size_t type = index_of_type<M>();
    constexpr Overflow policy = M::kOverflow;
    if constexpr (policy == Overflow::kLatestOnly || policy == Overflow::kLatestByKey) {
      std::uint64_t key = 0;
      if constexpr (policy == Overflow::kLatestByKey) key = message.key();
      const auto slot = latest_.find({type, key});
      if (slot != latest_.end()) {
        displaced.emplace(std::move(slot->second->message));
        slot->second->message.template emplace<type>(std::forward<M>(message));
        return Delivery::kReplaced;
      }
      if (policy == Overflow::kLatestByKey && bounded_ >= capacity_) return Delivery::kRefusedFull;
      append(std::forward<M>(message), key);
      latest_.emplace(std::pair{type, key}, std::prev(queue_.end()));
      return Delivery::kQueued;
    } else {
      if (bounded_ < capacity_) {
        append(std::forward<M>(message), 0);
        return Delivery::kQueued;
      }
      if constexpr (policy == Overflow::kDropOldest) {
        for (auto it = queue_.begin(); it != queue_.end(); ++it) {
          if (it->message.index() != type) continue;
          displaced.emplace(std::move(it->message));
          queue_.erase(it);
          --bounded_;
          append(std::forward<M>(message), 0);
          return Delivery::kMadeRoom;
        }
      }
      return Delivery::kRefusedFull;
    }
  }

  /// The oldest message, or nothing. A replaced message keeps the place of the one it replaced.
  std::optional<Inbox> pop() {
    if (queue_.empty()) return std::nullopt;
    Entry& front = queue_.front();
    if (front.latest) latest_.erase({front.message.index(), front.key});
    if (front.counted) --bounded_;
    std::optional<Inbox> message(std::move(front.message));
    queue_.pop_front();
    return message;
  }

  [[nodiscard]] std::size_t size() const { return queue_.size(); }
  [[nodiscard]] bool empty() const { return queue_.empty(); }

 private:
  struct Entry {
    Inbox message;
    std::uint64_t key;
    bool latest;   // has an entry in latest_
    bool counted;  // takes one of capacity_
  };
  using Queue = std::list<Entry>;

  template <class M>
  static constexpr std::size_t index_of_type() {
    constexpr bool same[] = {std::is_same_v<M, Ms>...};
    for (std::size_t i = 0; i < sizeof...(Ms); ++i)
      if (same[i]) return i;
    return sizeof...(Ms);
  }

  template <class M>
  void append(M&& message, std::uint64_t key) {
    constexpr bool latest = M::kOverflow == Overflow::kLatestOnly || M::kOverflow == Overflow::kLatestByKey;
    constexpr bool counted = M::kOverflow != Overflow::kLatestOnly;
    queue_.push_back(Entry{Inbox(std::in_place_type<M>, std::forward<M>(message)), key, latest, counted});
    if (counted) ++bounded_;
  }

  std::size_t capacity_;
  std::size_t bounded_ = 0;
  Queue queue_;
  std::map<std::pair<std::size_t, std::uint64_t>, typename Queue::iterator> latest_;
};

}  // namespace darm::runtime
