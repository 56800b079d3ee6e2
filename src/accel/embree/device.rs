//! The Embree device: what it can do, the first error it reports, the memory it holds.

use std::ffi::CString;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicIsize, Ordering};
use std::sync::{Arc, OnceLock};

use super::callbacks;
use super::sys::{self, RTCDeviceProperty, RTCError};
use crate::error::{Error, Result};

/// What Embree reports of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmbreeInfo {
    /// Version, such as `3.13.5`.
    pub version: String,
    /// Instruction set, such as `AVX-512`: the best of those that Embree has code for and the processor runs, which is
    /// what Embree chooses. Embree has no query for it.
    pub isa: String,
}

impl EmbreeInfo {
    /// Queries the installed Embree, without a scene.
    ///
    /// # Errors
    /// If no device can be made, or the build of Embree lacks something this crate needs.
    pub fn query() -> Result<Self> {
        Ok(Device::new(1)?.info())
    }

    /// A bound for the relative error of the reciprocals that distances of triangles are found with, so that hits that
    /// near the end of a ray's interval may be missed or found beyond it; 0 if those of powers of two are exact.
    /// Without AVX-512 an estimate of 11 bits is refined once, which leaves the last bit.
    pub fn reciprocal_error(&self) -> f32 {
        if self.isa == "AVX-512" { 0.0 } else { 2.0 * f32::EPSILON }
    }
}

/// What the callbacks of a device write to.
#[derive(Default)]
pub(super) struct Monitor {
    pub(super) first_error: OnceLock<(RTCError, String)>,
    pub(super) bytes: AtomicIsize,
}

impl Monitor {
    /// Bytes that Embree has taken and not given back.
    pub(super) fn bytes(&self) -> isize {
        self.bytes.load(Ordering::Relaxed)
    }
}

/// An Embree device.
pub(super) struct Device {
    handle: NonNull<sys::RTCDeviceTy>,
    /// Behind an `Arc`, since Embree keeps its address.
    monitor: Arc<Monitor>,
}

// SAFETY: a device is a reference-counted object whose functions may be called from any thread; those that must not run
// at the same time as others are called while the device is still owned by a builder.
unsafe impl Send for Device {}
// SAFETY: as above; through a shared reference only properties, error and byte count are read.
unsafe impl Sync for Device {}

impl Device {
    /// A device with `threads` threads for building (0: all).
    ///
    /// # Errors
    /// If Embree cannot make one, or lacks triangles, user geometry or filter functions.
    pub(super) fn new(threads: usize) -> Result<Self> {
        let config = if threads == 0 { String::new() } else { format!("threads={threads}") };
        let config =
            CString::new(config).map_err(|_| Error::Internal("a device configuration with a zero byte".into()))?;
        // SAFETY: the configuration is a C string, which Embree copies.
        let handle = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            // SAFETY: with a null device, the call returns the error of the failed creation on this thread.
            let code = unsafe { sys::rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(device_error(code, "no device could be created"));
        };
        let monitor = Arc::<Monitor>::default();
        let user = Arc::as_ptr(&monitor).cast_mut().cast();
        // SAFETY: the monitor does not move and outlives the device (see `drop`); the callbacks only use its atomics.
        unsafe {
            sys::rtcSetDeviceErrorFunction(handle.as_ptr(), Some(callbacks::on_error), user);
            sys::rtcSetDeviceMemoryMonitorFunction(handle.as_ptr(), Some(callbacks::on_memory), user);
        }
        let device = Self { handle, monitor };
        device.check_abilities()?;
        Ok(device)
    }

    pub(super) fn handle(&self) -> sys::RTCDevice {
        self.handle.as_ptr()
    }

    /// The first error reported, if any.
    pub(super) fn check(&self) -> Result<()> {
        match self.monitor.first_error.get() {
            None => Ok(()),
            Some((code, message)) => Err(device_error(*code, message)),
        }
    }

    /// Bytes Embree holds.
    pub(super) fn memory_bytes(&self) -> usize {
        usize::try_from(self.monitor.bytes()).unwrap_or(0)
    }

    /// What counts the bytes, which outlives the device.
    pub(super) fn memory(&self) -> Arc<Monitor> {
        Arc::clone(&self.monitor)
    }

    pub(super) fn info(&self) -> EmbreeInfo {
        let part = |property| self.property(property);
        let version = format!(
            "{}.{}.{}",
            part(sys::RTC_DEVICE_PROPERTY_VERSION_MAJOR),
            part(sys::RTC_DEVICE_PROPERTY_VERSION_MINOR),
            part(sys::RTC_DEVICE_PROPERTY_VERSION_PATCH)
        );
        EmbreeInfo { version, isa: instruction_set().into() }
    }

    fn property(&self, property: RTCDeviceProperty) -> isize {
        // SAFETY: the device is alive and the property is one of the header's.
        unsafe { sys::rtcGetDeviceProperty(self.handle(), property) }
    }

    fn check_abilities(&self) -> Result<()> {
        let major = self.property(sys::RTC_DEVICE_PROPERTY_VERSION_MAJOR);
        if major != sys::RTC_VERSION_MAJOR as isize {
            return Err(Error::Embree(format!(
                "version {major} is installed, but this program was built for {}",
                sys::RTC_VERSION_MAJOR
            )));
        }
        let needed = [
            (sys::RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED, "triangles"),
            (sys::RTC_DEVICE_PROPERTY_USER_GEOMETRY_SUPPORTED, "user geometry"),
            (sys::RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED, "filter functions"),
        ];
        for (property, name) in needed {
            if self.property(property) == 0 {
                return Err(Error::Embree(format!("the installed library was built without {name}")));
            }
        }
        if self.property(sys::RTC_DEVICE_PROPERTY_BACKFACE_CULLING_ENABLED) != 0 {
            return Err(Error::Embree("the installed library was built with back-face culling".into()));
        }
        self.check()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this is the last use of the handle; the monitor is dropped after this body, when no callback can come
        // any more.
        unsafe { sys::rtcReleaseDevice(self.handle()) }
    }
}

fn device_error(code: RTCError, message: &str) -> Error {
    if code == sys::RTC_ERROR_OUT_OF_MEMORY {
        return Error::OutOfMemory(format!("Embree: {message}"));
    }
    let kind = match code {
        sys::RTC_ERROR_INVALID_ARGUMENT => "invalid argument",
        sys::RTC_ERROR_INVALID_OPERATION => "invalid operation",
        sys::RTC_ERROR_UNSUPPORTED_CPU => "unsupported processor",
        sys::RTC_ERROR_CANCELLED => "cancelled",
        _ => "unknown error",
    };
    Error::Embree(format!("{kind}: {message}"))
}

/// The best instruction set that both Embree and this processor have.
#[cfg(target_arch = "x86_64")]
fn instruction_set() -> &'static str {
    use std::arch::is_x86_feature_detected as has;
    if has!("avx512f") && has!("avx512dq") && has!("avx512cd") && has!("avx512bw") && has!("avx512vl") {
        "AVX-512"
    } else if has!("avx2") && has!("fma") && has!("f16c") && has!("bmi1") && has!("bmi2") && has!("lzcnt") {
        "AVX2"
    } else if has!("avx") {
        "AVX"
    } else if has!("sse4.2") {
        "SSE4.2"
    } else {
        "SSE2"
    }
}

/// The best instruction set that both Embree and this processor have.
#[cfg(not(target_arch = "x86_64"))]
fn instruction_set() -> &'static str {
    "NEON"
}
