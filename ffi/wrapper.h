/* What bindgen reads. */
#include "embree_shim.h"
