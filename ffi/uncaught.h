/* The end of the program by an exception of C++. */

#ifndef STERADIAN_UNCAUGHT_H
#define STERADIAN_UNCAUGHT_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Gets whether memory or threads ran out, and a description that lives during the call. Does not return. */
typedef void (*StUncaught)(bool out_of_memory, const char *what);

/* Has `report` called in place of abort() for every exception that nobody catches. */
void st_on_uncaught(StUncaught report);

#ifdef __cplusplus
}
#endif

#endif
