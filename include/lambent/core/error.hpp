#pragma once
#include <lambent/core/config.hpp>
#include <stdexcept>
#include <string>
#if !defined(__cpp_exceptions)
#include <cstdlib>
#endif

namespace lambent {

/// What every checked function of the library throws: one sentence with the file and the numbers in it.
/// It lives outside the flag namespace so that one `catch` serves a whole program.
class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Called in place of a throw where the program is compiled without exceptions; must not return.
using ErrorHandler = void (*)(const std::string& message);

/// The handler in use; assign your own before the first call. The default ends the program.
inline ErrorHandler& error_handler() {
    static ErrorHandler handler = nullptr;
    return handler;
}

inline namespace LAMBENT_ABI {

/// The one place that throws.
[[noreturn]] inline void fail(const std::string& message) {
#if defined(__cpp_exceptions)
    throw Error(message);
#else
    if (error_handler() != nullptr) error_handler()(message);
    std::abort();
#endif
}

/// Fails with `message()`, made only then, unless `condition` holds. For the library's borders, never for
/// per-ray code.
template <class Message>
inline void require(bool condition, Message&& message) {
    if (condition) return;
    if constexpr (requires { message(); }) {
        fail(message());
    } else {
        fail(message);
    }
}

} // namespace LAMBENT_ABI
} // namespace lambent
