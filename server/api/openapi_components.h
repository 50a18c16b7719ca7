#pragma once
// The shared parts of the OpenAPI document: parameters, schemas and the one error response, as JSON text.

#include <string>

namespace kiln {

std::string openapi_components();

}  // namespace kiln
