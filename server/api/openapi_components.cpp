#include "server/api/openapi_components.h"

namespace kiln {
namespace {

constexpr const char* kParameters = R"json({
  "id": {"name": "id", "in": "path", "required": true, "schema": {"type": "string"}, "description": "Job id"},
  "name": {"name": "name", "in": "path", "required": true, "schema": {"type": "string"}, "description": "File name"},
  "sceneName": {"name": "name", "in": "query", "schema": {"type": "string", "maxLength": 255},
    "description": "Raw upload: name of the scene in messages"},
  "sha256": {"name": "sha256", "in": "path", "required": true, "schema": {"$ref": "#/components/schemas/Sha256"}},
  "preset": {"name": "preset", "in": "query", "schema": {"type": "string"},
    "description": "Raw upload: the recipe's name; see /v1/presets"},
  "label": {"name": "label", "in": "query", "schema": {"type": "string"},
    "description": "Free text of a job; in a list: only jobs with exactly this one"},
  "environment": {"name": "environment", "in": "query", "schema": {"type": "string"},
    "description": "Raw upload: name of a built-in sky, r,g,b, or the sha256 of an uploaded .hdr or .exr"},
  "quality": {"name": "quality", "in": "query", "schema": {"enum": ["draft", "standard", "final"]}},
  "seed": {"name": "seed", "in": "query", "schema": {"type": "integer", "minimum": 0}},
  "force": {"name": "force", "in": "query", "schema": {"type": "boolean"},
    "description": "Bake even if the same result is known"},
  "idempotencyKey": {"name": "Idempotency-Key", "in": "header", "schema": {"type": "string", "maxLength": 255},
    "description": "The same key and request again gives the first job (200); with another request 422"},
  "prefer": {"name": "Prefer", "in": "header", "schema": {"type": "string"}, "example": "wait=10",
    "description": "Answer when the job is done, or after that many seconds (at most 60)"},
  "status": {"name": "status", "in": "query", "schema": {"$ref": "#/components/schemas/Status"}},
  "limit": {"name": "limit", "in": "query", "schema": {"type": "integer", "minimum": 1, "maximum": 200, "default": 50}},
  "cursor": {"name": "cursor", "in": "query", "schema": {"type": "string"}, "description": "next_cursor of a page"},
  "wait": {"name": "wait", "in": "query", "schema": {"type": "integer", "minimum": 0, "maximum": 60}},
  "lastEventId": {"name": "Last-Event-ID", "in": "header", "schema": {"type": "integer"},
    "description": "Replay what came after this event"},
  "range": {"name": "Range", "in": "header", "schema": {"type": "string"}, "example": "bytes=0-1023"},
  "download": {"name": "download", "in": "query", "schema": {"type": "integer", "enum": [1]},
    "description": "Put the job's id into the proposed file name"},
  "uploadOffset": {"name": "Upload-Offset", "in": "header", "schema": {"type": "integer", "minimum": 0},
    "description": "Resume an interrupted upload here; must be what HEAD of the asset tells"},
  "upload": {"name": "upload", "in": "path", "required": true, "schema": {"type": "string"}, "description": "Upload id"},
  "tusResumable": {"name": "Tus-Resumable", "in": "header", "required": true, "schema": {"const": "1.0.0"}},
  "uploadLength": {"name": "Upload-Length", "in": "header", "required": true,
    "schema": {"type": "integer", "minimum": 1}, "description": "Bytes of the whole file"},
  "uploadMetadata": {"name": "Upload-Metadata", "in": "header", "schema": {"type": "string", "maxLength": 4096},
    "description": "name base64,name base64; sha256 (64 hex digits) is checked at the end"},
  "pieceOffset": {"name": "Upload-Offset", "in": "header", "required": true, "schema": {"type": "integer", "minimum": 0},
    "description": "Where the piece begins: what HEAD tells"},
  "uploadChecksum": {"name": "Upload-Checksum", "in": "header", "schema": {"type": "string"},
    "description": "sha256 or sha1 and base64 of the piece, which then counts whole or not at all"},
  "webhookId": {"name": "webhook-id", "in": "header", "required": true, "schema": {"type": "string"},
    "description": "The same in every try: drop what you have seen"},
  "webhookTimestamp": {"name": "webhook-timestamp", "in": "header", "required": true, "schema": {"type": "integer"},
    "description": "Seconds since 1970, of this try: refuse what is minutes away"},
  "webhookSignature": {"name": "webhook-signature", "in": "header", "required": true, "schema": {"type": "string"},
    "description": "v1, and the base64 of HMAC-SHA256 over id.timestamp.body; the key is that of the receiver's secret"}
})json";

constexpr const char* kJobSchemas = R"json(
  "Sha256": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
  "Status": {"enum": ["queued", "running", "succeeded", "failed", "canceled"]},
  "Recipe": {"$ref": "/v1/schema/recipe.json"},
  "JobDocument": {"description": "A recipe (see /v1/schema/recipe.json) with its scene as an asset, and two members more",
    "type": "object", "properties": {
      "preset": {"type": "string", "description": "Base of the recipe; members given beside it win"},
      "force": {"type": "boolean", "default": false},
      "scene": {"type": "object", "properties": {"asset": {"$ref": "#/components/schemas/Sha256"}}, "required": ["asset"]}}},
  "JobForm": {"type": "object", "required": ["scene"], "properties": {
      "job": {"$ref": "#/components/schemas/JobDocument"},
      "scene": {"type": "string", "contentMediaType": "application/octet-stream"},
      "environment": {"type": "string", "contentMediaType": "application/octet-stream"},
      "resource": {"type": "array", "items": {"type": "string", "contentMediaType": "application/octet-stream"},
        "description": "Files that a .gltf names; the file name is the URI"}}},
  "Progress": {"type": "object", "required": ["stage", "done", "total", "fraction", "eta_s"], "properties": {
      "stage": {"type": "string"}, "done": {"type": "integer"}, "total": {"type": "integer"},
      "fraction": {"type": "number", "minimum": 0, "maximum": 1}, "eta_s": {"type": ["number", "null"]},
      "error": {"type": "number"}}},
  "Artifact": {"type": "object", "required": ["name", "bytes", "sha256", "media_type", "url"], "properties": {
      "name": {"type": "string"}, "bytes": {"type": "integer"}, "sha256": {"$ref": "#/components/schemas/Sha256"},
      "media_type": {"type": "string"}, "url": {"type": "string"}}},
  "ArtifactList": {"type": "object", "required": ["artifacts"], "properties": {
      "artifacts": {"type": "array", "items": {"$ref": "#/components/schemas/Artifact"}}}},
  "Job": {"type": "object",
    "required": ["id", "label", "status", "created_at", "started_at", "finished_at", "attempt", "cached", "pinned", "recipe",
                 "progress", "error", "artifacts", "links"],
    "properties": {
      "id": {"type": "string"}, "label": {"type": "string"}, "status": {"$ref": "#/components/schemas/Status"},
      "created_at": {"type": ["string", "null"], "format": "date-time"},
      "started_at": {"type": ["string", "null"], "format": "date-time"},
      "finished_at": {"type": ["string", "null"], "format": "date-time"},
      "attempt": {"type": "integer"}, "cached": {"type": "boolean"}, "pinned": {"type": "boolean"},
      "recipe": {"type": "object"},
      "progress": {"oneOf": [{"$ref": "#/components/schemas/Progress"}, {"type": "null"}]},
      "error": {"oneOf": [{"$ref": "#/components/schemas/Problem"}, {"type": "null"}]},
      "artifacts": {"type": "array", "items": {"$ref": "#/components/schemas/Artifact"}},
      "links": {"type": "object", "properties": {"self": {"type": "string"}, "events": {"type": "string"},
        "view": {"type": "string"}, "artifacts": {"type": "string"}, "bundle": {"type": "string"}}}}},
  "History": {"type": "object", "required": ["job", "events"], "properties": {
      "job": {"type": "string"},
      "events": {"type": "array", "items": {"type": "object", "required": ["id", "at", "kind", "status", "message"],
        "properties": {"id": {"type": "integer"}, "at": {"type": "string", "format": "date-time"},
          "kind": {"enum": ["state", "log", "artifact", "done"]}, "status": {"$ref": "#/components/schemas/Status"},
          "message": {"type": "string"}}}}}},
  "WebhookMessage": {"type": "object", "required": ["type", "timestamp", "data"], "properties": {
      "type": {"enum": ["job.succeeded", "job.failed", "job.canceled"]},
      "timestamp": {"type": "string", "format": "date-time"},
      "data": {"type": "object", "description": "Of a job that was removed meanwhile: id and status alone",
        "required": ["id", "status"], "properties": {
          "id": {"type": "string"}, "status": {"enum": ["succeeded", "failed", "canceled"]}, "label": {"type": "string"},
          "cached": {"type": "boolean"}, "attempt": {"type": "integer"}, "tenant": {"type": "string"},
          "created_at": {"type": "string", "format": "date-time"}, "finished_at": {"type": "string", "format": "date-time"},
          "error": {"type": "object", "required": ["code", "detail", "where"], "properties": {
            "code": {"type": "string"}, "detail": {"type": "string"}, "where": {"type": "string"}}}}}}},
  "JobList": {"type": "object", "required": ["jobs", "next_cursor"], "properties": {
      "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/Job"}}, "next_cursor": {"type": ["string", "null"]}}},
)json";

constexpr const char* kOtherSchemas = R"json(
  "Asset": {"type": "object", "required": ["sha256", "bytes", "existed"], "properties": {
      "sha256": {"$ref": "#/components/schemas/Sha256"}, "bytes": {"type": "integer"}, "existed": {"type": "boolean"}}},
  "Upload": {"type": "object", "required": ["id", "length", "offset", "expires_at", "asset"], "properties": {
      "id": {"type": "string"}, "length": {"type": "integer"}, "offset": {"type": "integer"},
      "expires_at": {"type": "string", "format": "date-time"}, "asset": {"type": ["string", "null"]}}},
  "PresetList": {"type": "object", "required": ["presets"], "properties": {"presets": {"type": "array", "items": {
      "type": "object", "required": ["name", "description", "recipe"], "properties": {"name": {"type": "string"},
        "description": {"type": "string"}, "recipe": {"type": "object"}}}}}},
  "Plan": {"type": "object"},
  "Readiness": {"type": "object", "required": ["ready", "reasons", "checks"], "properties": {
      "ready": {"type": "boolean"}, "reasons": {"type": "array", "items": {"type": "string"}},
      "checks": {"type": "object", "additionalProperties": {"type": "string"}}}},
  "Version": {"type": "object", "required": ["engine", "api"], "properties": {"engine": {"type": "string"},
      "api": {"type": "string"}}},
  "Problem": {"type": "object", "required": ["type", "title", "status", "detail"], "properties": {
      "type": {"type": "string", "format": "uri"}, "title": {"type": "string"}, "status": {"type": "integer"},
      "detail": {"type": "string"}, "request_id": {"type": "string"}, "where": {"type": "string"},
      "errors": {"type": "array", "items": {"type": "object", "required": ["pointer", "detail"], "properties": {
        "pointer": {"type": "string", "description": "JSON pointer; ?name for a query parameter"},
        "detail": {"type": "string"}, "received": {}, "allowed": {"type": "string"}}}}}},
  "Binary": {"type": "string", "contentMediaType": "application/octet-stream"},
  "EventText": {"type": "string", "description": "state and done carry a Job, progress a Progress, artifact an Artifact, each with the member job"},
  "Text": {"type": "string"},
  "Any": {"type": "object"}
)json";

constexpr const char* kResponses = R"json({
  "Problem": {"description": "RFC 9457 problem",
    "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}}
})json";

}  // namespace

std::string openapi_components() {
  std::string text = "{\"parameters\":";
  text += kParameters;
  text += ",\"responses\":";
  text += kResponses;
  text += ",\"schemas\":{";
  text += kJobSchemas;
  text += kOtherSchemas;
  return text + "}}";
}

}  // namespace kiln
