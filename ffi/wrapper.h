/* What bindgen reads. */
#include "embree_shim.h"
#include "uncaught.h"
