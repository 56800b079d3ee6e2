//! Finds Embree, binds it and compiles the shim; a missing package ends the build with its name. On docs.rs, which has
//! neither Embree nor libclang, checked-in bindings serve.

use std::env;
use std::path::{Path, PathBuf};

/// Major versions this crate is written for, the one it is measured with first. Debian 12 has 3, Debian 13 has 4.
const EMBREE_VERSIONS: [u32; 2] = [3, 4];

fn main() {
    println!("cargo::rerun-if-changed=ffi");
    println!("cargo::rerun-if-changed=build.rs");
    for variable in ["DOCS_RS", "EMBREE_DIR"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    look_for_instructions();
    let built = if env::var_os("DOCS_RS").is_some() { use_checked_in_bindings() } else { build() };
    if let Err(message) = built {
        println!("cargo::error={message}");
    }
}

fn build() -> Result<(), String> {
    // EMBREE_DIR names the prefix of an Embree outside the system's directories.
    let own = env::var_os("EMBREE_DIR").map(PathBuf::from);
    let prefixes: Vec<PathBuf> = own.iter().cloned().chain(["/usr".into(), "/usr/local".into()]).collect();
    let (prefix, version) =
        find_embree(&prefixes).ok_or("Embree's headers are missing; on Debian: apt install libembree-dev")?;
    let include = format!("-I{}", prefix.join("include").display());
    let define = format!("-DSTERADIAN_EMBREE={version}");

    bind(&[&include, &define])?;
    cc::Build::new()
        .file("ffi/embree_shim.c")
        .flag(&include)
        .flag(&define)
        .std("c11")
        .opt_level(2)
        .flag_if_supported("-fno-plt")
        .try_compile("steradian_embree_shim")
        .map_err(|error| {
            format!("the C shim does not compile; on Debian: apt install build-essential ({})", one_line(&error))
        })?;

    cc::Build::new()
        .cpp(true)
        .file("ffi/uncaught.cpp")
        .std("c++17")
        .opt_level(2)
        .try_compile("steradian_uncaught")
        .map_err(|error| {
            format!("the C++ part does not compile; on Debian: apt install build-essential ({})", one_line(&error))
        })?;

    if own.is_some_and(|own| own == prefix) {
        println!("cargo::rustc-link-search=native={}", prefix.join("lib").display());
    }
    println!("cargo::rustc-link-lib=dylib=embree{version}");
    Ok(())
}

/// Enough for documentation, which is never linked. `ffi/embree_docs.rs` is what [`bind`] writes with Embree 3, without
/// the checks of layouts.
fn use_checked_in_bindings() -> Result<(), String> {
    let file = "ffi/embree_docs.rs";
    std::fs::copy(file, bindings_file()?).map(drop).map_err(|error| format!("cannot copy {file}: {error}"))
}

fn bindings_file() -> Result<PathBuf, String> {
    Ok(PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?).join("embree.rs"))
}

/// Sets `cfg(avx2)` and `cfg(avx512)`: tests of these instructions are reported as ignored without them.
fn look_for_instructions() {
    for name in ["avx2", "avx512"] {
        println!("cargo::rustc-check-cfg=cfg({name})");
    }
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx2") && has!("fma") {
            println!("cargo::rustc-cfg=avx2");
        }
        if has!("avx512f") && has!("avx512bw") && has!("avx512dq") && has!("avx512vl") {
            println!("cargo::rustc-cfg=avx512");
        }
    }
}

/// The first prefix with Embree's headers, and the major version found there.
fn find_embree(prefixes: &[PathBuf]) -> Option<(&Path, u32)> {
    let has = |prefix: &Path, version: u32| prefix.join(format!("include/embree{version}/rtcore.h")).is_file();
    prefixes
        .iter()
        .find_map(|prefix| EMBREE_VERSIONS.into_iter().find(|&v| has(prefix, v)).map(|v| (prefix.as_path(), v)))
}

/// Writes `embree.rs` into the output directory.
fn bind(arguments: &[&str]) -> Result<(), String> {
    let builder = bindgen::builder()
        .header("ffi/wrapper.h")
        .clang_args(arguments)
        .allowlist_function("st_.*|rtc(New|Release)(Device|Scene|Geometry)|rtc(Get|Set)Device.*")
        .allowlist_function(
            "rtcSet(SharedGeometryBuffer|Geometry(InstancedScene|Transform|TimeStepCount|BuildQuality|\
             UserPrimitiveCount))",
        )
        .allowlist_function(
            "rtcSetScene(Flags|BuildQuality)|rtcCommit(Geometry|Scene)|rtcAttachGeometryByID|rtcGetSceneBounds",
        )
        .allowlist_var("RTC_VERSION_MAJOR")
        .prepend_enum_name(false)
        .generate_comments(false)
        .derive_default(true)
        .merge_extern_blocks(true);
    // bindgen panics if libclang cannot be loaded.
    std::panic::set_hook(Box::new(|_| {}));
    let bound = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| builder.generate()));
    let _ = std::panic::take_hook();
    let bindings = match bound {
        Err(_) => return Err("libclang is missing; on Debian: apt install libclang-dev".into()),
        Ok(Err(error)) => return Err(format!("Embree's headers cannot be read ({})", one_line(&error))),
        Ok(Ok(bindings)) => bindings,
    };
    let out = bindings_file()?;
    bindings.write_to_file(&out).map_err(|error| format!("cannot write {}: {error}", out.display()))
}

fn one_line(error: &impl ToString) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
