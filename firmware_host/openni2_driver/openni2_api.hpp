// OpenNI2's driver interface, with the two macros of its own base library that it forgets to bring.
#pragma once

#include <cstddef>

#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#include <Driver/OniDriverAPI.h>
