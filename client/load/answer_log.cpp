#include "client/load/answer_log.hpp"

namespace darm::client::load {
namespace {

float milliseconds(std::int64_t us) { return static_cast<float>(us) / 1000.0f; }

}  // namespace

void AnswerLog::sent(std::uint64_t sequence, std::int64_t at_us) {
  newest_sent_ = sequence;
  waiting_.push_back({sequence, at_us});
  if (waiting_.size() > kMostWaiting) waiting_.pop_front();
}

AnswerNews AnswerLog::answered(std::uint64_t sequence, std::int64_t at_us, std::vector<float>& waits_ms) {
  if (sequence == 0) return AnswerNews::kNone;
  if (sequence > newest_sent_) return AnswerNews::kUnsent;
  if (sequence < newest_answered_) return AnswerNews::kBackwards;
  if (sequence == newest_answered_) return AnswerNews::kAgain;
  newest_answered_ = sequence;
  while (!waiting_.empty() && waiting_.front().sequence <= sequence) {
    waits_ms.push_back(milliseconds(at_us - waiting_.front().at_us));
    waiting_.pop_front();
  }
  return AnswerNews::kAnswer;
}

void AnswerLog::still_waiting(std::int64_t from_us, std::int64_t at_us, std::int64_t least_us,
                              std::vector<float>& waits_ms) const {
  for (const auto& camera : waiting_) {
    if (camera.at_us >= from_us && at_us - camera.at_us >= least_us)
      waits_ms.push_back(milliseconds(at_us - camera.at_us));
  }
}

}  // namespace darm::client::load
