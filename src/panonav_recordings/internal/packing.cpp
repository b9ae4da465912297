#include "panonav_recordings/internal/packing.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <new>

#include "panonav/core/error.hpp"

namespace panonav::recordings {

namespace {

// Unpacks into `to` after its first `filled` bytes, and updates `filled`. Returns true if the
// stream ended within `to`.
bool unpack_lz4(std::span<const std::uint8_t> from, std::span<std::uint8_t> to,
                std::size_t& filled) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0)
    throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, LZ4F_freeDecompressionContext);
  LZ4F_decompressOptions_t options{};
  options.stableDst = 1;
  while (true) {
    std::size_t written = to.size() - filled;
    std::size_t read = from.size();
    const std::size_t left =
        LZ4F_decompress(raw, to.data() + filled, &written, from.data(), &read, &options);
    if (LZ4F_isError(left) != 0) return false;
    filled += written;
    from = from.subspan(read);
    if (left == 0) return true;
    if (read == 0 && written == 0) return false;
  }
}

bool unpack_zstd(std::span<const std::uint8_t> from, std::span<std::uint8_t> to,
                 std::size_t& filled) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                     ZSTD_freeDCtx);
  if (!context) throw std::bad_alloc();
  // Limits the window, which takes memory too, to 128 MiB; the contiguous output buffer serves as
  // window.
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, 27);
  ZSTD_inBuffer in{from.data(), from.size(), 0};
  ZSTD_outBuffer out{to.data(), to.size(), 0};
  while (true) {
    const std::size_t before = in.pos + out.pos;
    const std::size_t left = ZSTD_decompressStream(context.get(), &out, &in);
    filled = out.pos;
    if (ZSTD_isError(left) != 0) return false;
    if (left == 0) return true;
    if (in.pos + out.pos == before) return false;
  }
}

bool unpack_bz2(std::span<const std::uint8_t> from, std::span<std::uint8_t> to,
                std::size_t& filled) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> end(&stream,
                                                                       BZ2_bzDecompressEnd);
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(from.data()));
  stream.avail_in = static_cast<unsigned>(from.size());
  stream.next_out = reinterpret_cast<char*>(to.data());
  stream.avail_out = static_cast<unsigned>(to.size());
  int code = BZ_OK;
  while (code == BZ_OK) {
    const auto before = std::pair(stream.avail_in, stream.avail_out);
    code = BZ2_bzDecompress(&stream);
    if (before == std::pair(stream.avail_in, stream.avail_out)) break;
  }
  filled = to.size() - stream.avail_out;
  return code == BZ_STREAM_END;
}

}  // namespace

std::optional<Packing> parse_packing(std::string_view name) noexcept {
  if (name.empty() || name == "none") return Packing::none;
  if (name == "lz4") return Packing::lz4;
  if (name == "zstd") return Packing::zstd;
  if (name == "bz2") return Packing::bz2;
  return std::nullopt;
}

Unpacked unpack(std::span<const std::uint8_t> packed, Packing packing, std::size_t max_bytes) {
  require(std::max(packed.size(), max_bytes) < std::numeric_limits<unsigned>::max(), "packed bytes",
          static_cast<double>(packed.size()), "less than 4 GiB");
  Unpacked result;
  result.content = Buffer(max_bytes);
  const std::span<std::uint8_t> to(result.content.data.get(), max_bytes);
  std::size_t filled = 0;
  switch (packing) {
    case Packing::none:
      filled = std::min(packed.size(), max_bytes);
      if (filled > 0) std::memcpy(to.data(), packed.data(), filled);
      result.is_whole = filled == packed.size();
      break;
    case Packing::lz4:
      result.is_whole = unpack_lz4(packed, to, filled);
      break;
    case Packing::zstd:
      result.is_whole = unpack_zstd(packed, to, filled);
      break;
    case Packing::bz2:
      result.is_whole = unpack_bz2(packed, to, filled);
      break;
  }
  result.content.size = filled;
  return result;
}

Unpacked unpack_zstd_frame(std::span<const std::uint8_t> packed, std::size_t max_bytes) {
  // For a frame that does not state its size this is ZSTD_CONTENTSIZE_UNKNOWN, larger than any
  // size.
  const auto stated_size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  std::size_t size = static_cast<std::size_t>(std::min<std::uint64_t>(stated_size, max_bytes));
  if (stated_size == ZSTD_CONTENTSIZE_UNKNOWN)
    size = std::min(max_bytes, 16 * packed.size() + 4096);
  while (true) {
    Unpacked unpacked = unpack(packed, Packing::zstd, size);
    const bool is_full = !unpacked.is_whole && unpacked.content.size == size;
    if (!is_full || size == max_bytes || stated_size <= max_bytes) return unpacked;
    size = std::min(max_bytes, 16 * size);
  }
}

UnpackedFile unpack_zstd_file(const std::filesystem::path& packed, const std::filesystem::path& to,
                              std::uint64_t max_bytes) {
  std::ifstream from(packed, std::ios::binary);
  if (!from) throw FileError(packed.string(), "cannot be read");
  std::ofstream file(to, std::ios::binary);
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                     ZSTD_freeDCtx);
  if (!context) throw std::bad_alloc();
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, 27);
  std::vector<char> read(std::size_t{128} << 10U);
  std::vector<char> made(read.size());
  UnpackedFile done;
  std::size_t left = 1;  // bytes that the decoder still expects of a frame; 0 at its end
  while (from.read(read.data(), static_cast<std::streamsize>(read.size())), from.gcount() > 0) {
    ZSTD_inBuffer in{read.data(), static_cast<std::size_t>(from.gcount()), 0};
    bool is_full = true;
    while (in.pos < in.size || is_full) {
      ZSTD_outBuffer out{made.data(), made.size(), 0};
      left = ZSTD_decompressStream(context.get(), &out, &in);
      if (ZSTD_isError(left) != 0) return done;
      is_full = out.pos == out.size;
      if (done.bytes + out.pos > max_bytes) {
        done.exceeds_limit = true;
        return done;
      }
      file.write(made.data(), static_cast<std::streamsize>(out.pos));
      done.bytes += out.pos;
      if (left == 0 && in.pos == in.size) break;
    }
  }
  file.close();
  if (!file) throw FileError(packed.string(), "cannot be unpacked: the temporary folder is full");
  done.is_whole = left == 0;
  return done;
}

void pack(std::span<const std::uint8_t> bytes, Packing packing, std::vector<std::uint8_t>& packed) {
  std::size_t size = 0;
  if (packing == Packing::lz4) {
    LZ4F_preferences_t preferences{};
    preferences.frameInfo.blockSizeID = LZ4F_max4MB;
    preferences.frameInfo.contentSize = bytes.size();
    packed.resize(LZ4F_compressFrameBound(bytes.size(), &preferences));
    size =
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &preferences);
    if (LZ4F_isError(size) != 0) throw Error(LZ4F_getErrorName(size));
  } else {
    require(packing == Packing::zstd, "packing", static_cast<double>(packing), "lz4, zstd");
    constexpr int fastest = 1;
    packed.resize(ZSTD_compressBound(bytes.size()));
    size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), fastest);
    if (ZSTD_isError(size) != 0) throw Error(ZSTD_getErrorName(size));
  }
  packed.resize(size);
}

}  // namespace panonav::recordings
