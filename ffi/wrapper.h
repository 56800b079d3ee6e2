/* The one header that bindgen reads. */
#include "embree_shim.h"
