#pragma once
// DeliveryQueue over any database that speaks SQL. Internal to server/jobs.

#include "server/jobs/delivery.h"
#include "server/jobs/sql.h"

namespace kiln::sql {

class SqlDeliveries final : public DeliveryQueue {
 public:
  explicit SqlDeliveries(Engine& engine) : engine_(engine) {}

  Result<DeliveryMark> mark() override;
  Result<Wrote> add(std::uint64_t from, std::uint64_t to, std::span<const NewDelivery>, Millis longest) override;
  Result<std::optional<Delivery>> take(const std::string& receiver, Millis lease) override;
  Result<void> finish(const Delivery&) override;
  Result<void> retry(const Delivery&, Millis delay) override;

 private:
  Engine& engine_;
};

}  // namespace kiln::sql
