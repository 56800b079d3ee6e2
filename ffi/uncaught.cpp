/* What becomes of exceptions that nobody catches, such as std::bad_alloc in one of Embree's threads. */

#include "uncaught.h"

#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <exception>
#include <new>
#include <typeinfo>

static StUncaught handler;

static void on_terminate() {
    const std::type_info *type = abi::__cxa_current_exception_type();
    const char *what = type ? type->name() : "terminated";
    /* In flight past a destructor that then fails: the only exceptions that Embree and oneTBB throw below it are of memory and threads. */
    bool out_of_memory = std::uncaught_exceptions() > 0;
    if (type) {
        try {
            throw;
        } catch (const std::bad_alloc &error) {
            out_of_memory = true;
            what = error.what();
        } catch (const std::exception &error) {
            what = error.what();
        } catch (...) {
        }
        /* oneTBB's task groups end so when such an exception leaves their scope; a thread is refused with EAGAIN. */
        out_of_memory = out_of_memory || std::strstr(type->name(), "missing_wait") || std::strstr(what, "Resource temporarily unavailable");
    }
    handler(out_of_memory, what);
    std::abort();
}

extern "C" void st_on_uncaught(StUncaught report) {
    handler = report;
    std::set_terminate(on_terminate);
}
