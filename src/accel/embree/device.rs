//! Embree's device: version and abilities, the first error, and the memory in use.

use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, Ordering};

use super::sys;
use crate::error::{Error, Result};

/// What Embree reports of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmbreeInfo {
    /// Version, such as `3.13.5`.
    pub version: String,
    /// Instruction set, such as `AVX-512`: the widest that this processor has and Embree has code for. (Embree chooses by the same rule and
    /// does not tell.)
    pub isa: &'static str,
}

impl EmbreeInfo {
    /// Of the library that this program is linked with.
    ///
    /// # Errors
    /// If no device can be made.
    pub fn query() -> Result<Self> {
        Device::new(1).map(|device| device.info())
    }
}

/// What the callbacks of a device write to; they may run on any thread.
struct State {
    first_error: Mutex<Option<(sys::RTCError::Type, String)>>,
    bytes: AtomicI64,
}

/// A device; released on drop, after every object made from it (Embree counts references).
pub struct Device {
    handle: sys::RTCDevice,
    state: Box<State>,
}

// SAFETY: Embree's devices may be used and released from any thread; the state is synchronised.
unsafe impl Send for Device {}
// SAFETY: shared use is limited to queries that Embree documents as thread-safe, and to building, which takes `&mut` elsewhere.
unsafe impl Sync for Device {}

impl Device {
    /// A device that builds with the given number of threads (0: all).
    pub fn new(threads: usize) -> Result<Self> {
        let config = CString::new(format!("threads={threads}")).map_err(|e| Error::Internal(e.to_string()))?;
        // SAFETY: the configuration is a C string that outlives the call.
        let handle = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if handle.is_null() {
            // SAFETY: a null device asks for the error of the failed creation.
            let code = unsafe { sys::rtcGetDeviceError(ptr::null_mut()) };
            return Err(Error::Embree(format!("no device: error {code}")));
        }
        let state = Box::new(State { first_error: Mutex::new(None), bytes: AtomicI64::new(0) });
        let device = Self { handle, state };
        let user = (&raw const *device.state).cast_mut().cast::<c_void>();
        // SAFETY: the state is boxed and lives as long as the device handle.
        unsafe {
            sys::rtcSetDeviceErrorFunction(handle, Some(on_error), user);
            sys::rtcSetDeviceMemoryMonitorFunction(handle, Some(on_memory), user);
        }
        device.require_abilities()?;
        Ok(device)
    }

    /// Refuses builds of Embree that lack what the renderer rests on.
    fn require_abilities(&self) -> Result<()> {
        let needed = [
            (sys::RTCDeviceProperty::RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED, "triangles"),
            (sys::RTCDeviceProperty::RTC_DEVICE_PROPERTY_USER_GEOMETRY_SUPPORTED, "user geometry"),
        ];
        for (property, name) in needed {
            if self.property(property) == 0 {
                return Err(Error::Embree(format!("this build of Embree {} has no {name}", self.info().version)));
            }
        }
        // SAFETY: a constant of the headers.
        let header = unsafe { sys::st_header_version() } / 10_000;
        let library = self.property(sys::RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION_MAJOR);
        if library != header as isize {
            return Err(Error::Embree(format!("built for Embree {header}, but the library is Embree {library}")));
        }
        Ok(())
    }

    fn property(&self, property: sys::RTCDeviceProperty::Type) -> isize {
        // SAFETY: the handle is a live device.
        unsafe { sys::rtcGetDeviceProperty(self.handle, property) }
    }

    /// Version and instruction set.
    pub fn info(&self) -> EmbreeInfo {
        let version = self.property(sys::RTCDeviceProperty::RTC_DEVICE_PROPERTY_VERSION);
        EmbreeInfo { version: format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100), isa: widest_isa() }
    }

    /// The handle, for calls that build.
    pub fn handle(&self) -> sys::RTCDevice {
        self.handle
    }

    /// Bytes that Embree holds.
    pub fn memory_bytes(&self) -> usize {
        usize::try_from(self.state.bytes.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// The first error since the last call, if any.
    pub fn check(&self) -> Result<()> {
        let Ok(mut first) = self.state.first_error.lock() else {
            return Err(Error::Embree("the error callback failed".into()));
        };
        match first.take() {
            None => Ok(()),
            Some((sys::RTCError::RTC_ERROR_OUT_OF_MEMORY, message)) => Err(Error::OutOfMemory(message)),
            Some((_, message)) => Err(Error::Embree(message)),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is live; without the callbacks, nothing refers to the state afterwards even if another object keeps the
        // device alive a little longer.
        unsafe {
            sys::rtcSetDeviceErrorFunction(self.handle, None, ptr::null_mut());
            sys::rtcSetDeviceMemoryMonitorFunction(self.handle, None, ptr::null_mut());
            sys::rtcReleaseDevice(self.handle);
        }
    }
}

/// The widest instruction set that Embree has code for and this processor has.
fn widest_isa() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512vl") {
            return "AVX-512";
        }
        if is_x86_feature_detected!("avx2") {
            return "AVX2";
        }
        if is_x86_feature_detected!("avx") {
            return "AVX";
        }
        if is_x86_feature_detected!("sse4.2") {
            return "SSE4.2";
        }
        "SSE2"
    }
    #[cfg(not(target_arch = "x86_64"))]
    "NEON"
}

unsafe extern "C" fn on_error(user: *mut c_void, code: sys::RTCError::Type, message: *const c_char) {
    // SAFETY: `user` is the state given at creation, which outlives the callback; only shared access happens here.
    let state = unsafe { &*user.cast::<State>() };
    let message = if message.is_null() {
        format!("error {code}")
    } else {
        // SAFETY: Embree passes a C string that lives during the call.
        unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned()
    };
    if let Ok(mut first) = state.first_error.lock() {
        first.get_or_insert((code, message));
    }
}

unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: as in `on_error`.
    let state = unsafe { &*user.cast::<State>() };
    state.bytes.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}
