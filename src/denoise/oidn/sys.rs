//! The functions of the library's C interface that are used, found by name in a library opened at run time.
//!
//! Written after the reference of Open Image Denoise 2 (<https://www.openimagedenoise.org/documentation.html>).

use std::ffi::{c_char, c_int, c_void};

use libloading::Library;

/// A device of the library.
#[repr(C)]
pub struct OidnDevice {
    _opaque: [u8; 0],
}

/// A filter of the library.
#[repr(C)]
pub struct OidnFilter {
    _opaque: [u8; 0],
}

/// `OIDN_DEVICE_TYPE_CPU`.
pub const DEVICE_TYPE_CPU: c_int = 1;
/// `OIDN_ERROR_NONE`.
pub const ERROR_NONE: c_int = 0;
/// `OIDN_ERROR_OUT_OF_MEMORY`.
pub const ERROR_OUT_OF_MEMORY: c_int = 4;
/// `OIDN_FORMAT_FLOAT3`.
pub const FORMAT_FLOAT3: c_int = 3;

/// A function that version 1 has and version 2 lacks.
pub const OF_VERSION_1: &[u8] = b"oidnGetDevice1i\0";

macro_rules! functions {
    ($($name:ident: $symbol:literal, fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions; valid while the library is loaded.
        #[derive(Clone, Copy)]
        pub struct Functions {
            $(pub $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Finds every function, or names the first that is missing.
            ///
            /// # Safety
            /// The library's functions of these names have these types, and the library is not closed while the result
            /// is in use.
            pub unsafe fn find(library: &Library) -> Result<Self, &'static str> {
                // SAFETY: the caller vouches for the types and the library's life.
                unsafe {
                    Ok(Self { $($name: *library.get(concat!($symbol, "\0").as_bytes()).map_err(|_| $symbol)?,)* })
                }
            }
        }
    };
}

functions! {
    new_device: "oidnNewDevice", fn(c_int) -> *mut OidnDevice;
    release_device: "oidnReleaseDevice", fn(*mut OidnDevice);
    get_device_int: "oidnGetDeviceInt", fn(*mut OidnDevice, *const c_char) -> c_int;
    set_device_int: "oidnSetDeviceInt", fn(*mut OidnDevice, *const c_char, c_int);
    set_device_bool: "oidnSetDeviceBool", fn(*mut OidnDevice, *const c_char, bool);
    commit_device: "oidnCommitDevice", fn(*mut OidnDevice);
    get_device_error: "oidnGetDeviceError", fn(*mut OidnDevice, *mut *const c_char) -> c_int;
    new_filter: "oidnNewFilter", fn(*mut OidnDevice, *const c_char) -> *mut OidnFilter;
    release_filter: "oidnReleaseFilter", fn(*mut OidnFilter);
    set_shared_filter_image: "oidnSetSharedFilterImage",
        fn(*mut OidnFilter, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
    set_filter_bool: "oidnSetFilterBool", fn(*mut OidnFilter, *const c_char, bool);
    commit_filter: "oidnCommitFilter", fn(*mut OidnFilter);
    execute_filter: "oidnExecuteFilter", fn(*mut OidnFilter);
}
