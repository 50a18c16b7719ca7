#include "server/jobs/sql_deliveries.h"

namespace kiln::sql {

Result<DeliveryMark> SqlDeliveries::mark() {
  DeliveryMark mark;
  bool known = false;
  const auto look = [&](Connection& db) -> Result<void> {
    KILN_TRY(now, db.now_ms());
    KILN_TRY(rows, db.query("SELECT value FROM counter WHERE name='delivery'"));
    known = !rows.empty();
    mark = {known ? static_cast<std::uint64_t>(rows.front().integer(0)) : 0, now};
    return {};
  };
  KILN_DO(engine_.read(look));
  if (known) return mark;
  KILN_DO(engine_.write([&](Connection& db) -> Result<void> {
    KILN_DO(
        db.run("INSERT INTO counter SELECT 'delivery', coalesce(max(id), 0) FROM job_event WHERE true "
               "ON CONFLICT(name) DO NOTHING"));
    return look(db);
  }));
  return mark;
}

Result<Wrote> SqlDeliveries::add(std::uint64_t from, std::uint64_t to, std::span<const NewDelivery> deliveries,
                                 Millis longest) {
  Wrote wrote = Wrote::lost;
  KILN_DO(engine_.write([&](Connection& db) -> Result<void> {
    wrote = Wrote::lost;
    KILN_TRY(now, db.now_ms());
    KILN_TRY(moved, db.run("UPDATE counter SET value=? WHERE name='delivery' AND value=?", to, from));
    if (moved == 0) return {};
    KILN_DO(db.run("DELETE FROM delivery WHERE created_at<?", now - longest.count()));
    for (const NewDelivery& delivery : deliveries) {
      KILN_DO(
          db.run("INSERT INTO delivery(message, receiver, body, created_at, due_at) VALUES(?,?,?,?,?) "
                 "ON CONFLICT DO NOTHING",
                 delivery.message, delivery.receiver, delivery.body, now, now));
    }
    wrote = Wrote::done;
    return {};
  }));
  return wrote;
}

Result<std::optional<Delivery>> SqlDeliveries::take(const std::string& receiver, Millis lease) {
  // Look first: an idle sender costs no write.
  bool due = false;
  KILN_DO(engine_.read([&](Connection& db) -> Result<void> {
    KILN_TRY(now, db.now_ms());
    KILN_TRY(rows, db.query("SELECT 1 FROM delivery WHERE receiver=? AND due_at<=? LIMIT 1", receiver, now));
    due = !rows.empty();
    return {};
  }));
  std::optional<Delivery> taken;
  if (!due) return taken;
  KILN_DO(engine_.write([&](Connection& db) -> Result<void> {
    taken.reset();
    KILN_TRY(now, db.now_ms());
    const std::string next =
        "SELECT message, body, attempt, created_at FROM delivery WHERE receiver=? AND due_at<=? "
        "ORDER BY due_at, message LIMIT 1";
    KILN_TRY(rows, db.query(next + engine_.keep_rows(true), receiver, now));
    if (rows.empty()) return {};
    const Row& row = rows.front();
    KILN_DO(db.run("UPDATE delivery SET attempt=attempt+1, due_at=? WHERE message=? AND receiver=?",
                   now + lease.count(), row.text(0), receiver));
    taken = Delivery{row.text(0), receiver, row.text(1), static_cast<int>(row.integer(2)) + 1,
                     Millis(now - row.integer(3))};
    return {};
  }));
  return taken;
}

Result<void> SqlDeliveries::finish(const Delivery& delivery) {
  return engine_.write([&](Connection& db) -> Result<void> {
    KILN_DO(db.run("DELETE FROM delivery WHERE message=? AND receiver=?", delivery.message, delivery.receiver));
    return {};
  });
}

Result<void> SqlDeliveries::retry(const Delivery& delivery, Millis delay) {
  return engine_.write([&](Connection& db) -> Result<void> {
    KILN_TRY(now, db.now_ms());
    KILN_DO(db.run("UPDATE delivery SET due_at=? WHERE message=? AND receiver=?", now + delay.count(), delivery.message,
                   delivery.receiver));
    return {};
  });
}

}  // namespace kiln::sql
