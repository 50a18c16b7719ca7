#pragma once
// A Reply as bytes on a connection.

#include <string>

#include "server/http/message.h"

namespace kiln {

/// Status line and fields, empty line included. Security fields are added where the reply has none of that name.
std::string reply_head(const Reply&, const std::string& request_id);

/// Writes head and body; the head alone when `head_only`. False when the client did not take all of it.
bool write_reply(Sink&, const Reply&, const std::string& request_id, bool head_only);

}  // namespace kiln
