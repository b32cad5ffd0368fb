//! JSON bodies.
#![no_main]

use bagtrack_fuzz::Service;
use libfuzzer_sys::fuzz_target;

thread_local! {
    static SERVICE: Service = Service::new();
}

fuzz_target!(|data: &[u8]| {
    SERVICE.with(|service| {
        service.upload_twice("", "application/json", data, usize::MAX);
    });
});
