#include "panonav_ros2/internal/raw_topic.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

namespace panonav::ros2 {

namespace {

using ByteSpan = std::span<const std::uint8_t>;

struct RawSample : ddsi_serdata {
  RawSample(const ddsi_sertype* of, ddsi_serdata_kind what, std::size_t size) : ddsi_serdata() {
    ddsi_serdata_init(this, of, what);
    bytes.resize(size);
  }
  std::vector<std::uint8_t> bytes;  // size is a multiple of 4, as RTPS requires
};

RawSample& raw(ddsi_serdata* sample) {
  return *static_cast<RawSample*>(sample);
}
const RawSample& raw(const ddsi_serdata* sample) {
  return *static_cast<const RawSample*>(sample);
}

/// Makes a sample; null if there is no memory, because exceptions must not pass through C.
RawSample* make_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  try {
    return new RawSample(type, kind, size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

/// Assembles a sample from fragments, which may overlap. Missing ends and invalid CDR are left to
/// the reader of the message.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                             const nn_rdata* fragment, std::size_t size) {
  RawSample* const sample = make_sample(type, kind, size);
  if (sample == nullptr) return nullptr;
  std::size_t filled = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= filled) continue;
    const std::uint8_t* const payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    const std::size_t end = std::min<std::size_t>(fragment->maxp1, size);
    if (fragment->min > filled || end <= filled) break;
    std::memcpy(sample->bytes.data() + filled, payload + (filled - fragment->min), end - filled);
    filled = end;
  }
  return sample;
}

ddsi_serdata* from_vector(const ddsi_sertype* type, ddsi_serdata_kind kind,
                          ddsrt_msg_iovlen_t count, const ddsrt_iovec_t* parts, std::size_t size) {
  RawSample* const sample = make_sample(type, kind, size);
  if (sample == nullptr) return nullptr;
  std::size_t filled = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && filled < size; ++i) {
    const std::size_t length = std::min<std::size_t>(parts[i].iov_len, size - filled);
    std::memcpy(sample->bytes.data() + filled, parts[i].iov_base, length);
    filled += length;
  }
  return sample;
}

ddsi_serdata* from_bytes(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* span) {
  const ByteSpan bytes = *static_cast<const ByteSpan*>(span);
  const std::size_t size = (bytes.size() + 3) / 4 * 4;
  RawSample* const sample = make_sample(type, kind, size);
  if (sample == nullptr) return nullptr;
  std::ranges::copy(bytes, sample->bytes.begin());
  // The lowest bits of the header's options state the number of padding bytes at the end.
  constexpr std::size_t options_offset = 3;
  if (size > options_offset)
    sample->bytes[options_offset] = static_cast<std::uint8_t>(size - bytes.size());
  return sample;
}

/// Makes the key sample; all samples of a keyless type belong to one instance.
ddsi_serdata* make_key_sample(const ddsi_sertype* type) {
  RawSample* const sample = make_sample(type, SDK_KEY, 0);
  return sample;
}

const ddsi_serdata_ops sample_operations{
    .eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; },
    .get_size =
        [](const ddsi_serdata* sample) {
          return static_cast<std::uint32_t>(raw(sample).bytes.size());
        },
    .from_ser = from_fragments,
    .from_ser_iov = from_vector,
    .from_keyhash = [](const ddsi_sertype* type,
                       const ddsi_keyhash*) { return make_key_sample(type); },
    .from_sample = from_bytes,
    .to_ser = [](const ddsi_serdata* sample, std::size_t at, std::size_t count,
                 void* to) { std::memcpy(to, raw(sample).bytes.data() + at, count); },
    .to_ser_ref =
        [](const ddsi_serdata* sample, std::size_t at, std::size_t count, ddsrt_iovec_t* part) {
          part->iov_base = const_cast<std::uint8_t*>(raw(sample).bytes.data() + at);
          part->iov_len = static_cast<ddsrt_iov_len_t>(count);
          return ddsi_serdata_ref(sample);
        },
    .to_ser_unref = [](ddsi_serdata* sample, const ddsrt_iovec_t*) { ddsi_serdata_unref(sample); },
    .to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; },
    .to_untyped =
        [](const ddsi_serdata* sample) {
          ddsi_serdata* const untyped = make_key_sample(sample->type);
          if (untyped != nullptr) untyped->type = nullptr;
          return untyped;
        },
    .untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**,
                            void*) { return true; },
    .free = [](ddsi_serdata* sample) { delete &raw(sample); },
    .print =
        [](const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t size) {
          if (size > 0) text[0] = '\0';
          return std::size_t{0};
        },
    .get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash,
                      bool) { std::memset(hash->value, 0, sizeof hash->value); },
};

const ddsi_sertype_ops type_operations{
    .version = ddsi_sertype_v0,
    .arg = nullptr,
    .free =
        [](ddsi_sertype* type) {
          ddsi_sertype_fini(type);
          delete type;
        },
    .zero_samples = [](const ddsi_sertype*, void*, std::size_t) {},
    .realloc_samples = [](void**, const ddsi_sertype*, void*, std::size_t, std::size_t) {},
    .free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {},
    .equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; },
    .hash = [](const ddsi_sertype*) { return std::uint32_t{0}; },
};

}  // namespace

ddsi_sertype* make_raw_type(const std::string& name) {
  auto type = std::make_unique<ddsi_sertype>();
  ddsi_sertype_init(type.get(), name.c_str(), &type_operations, &sample_operations, true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return type.release();
}

std::span<const std::uint8_t> bytes_of(const ddsi_serdata& sample) {
  return raw(&sample).bytes;
}

}  // namespace panonav::ros2
