//! Multipart forms, in pieces of the size that the first byte says.
#![no_main]

use bagtrack_fuzz::Service;
use libfuzzer_sys::fuzz_target;

thread_local! {
    static SERVICE: Service = Service::new();
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, body)) = data.split_first() else {
        return;
    };
    let query = match piece % 2 {
        0 => "?box=16,12,16,12&seed=7",
        _ => "",
    };
    SERVICE.with(|service| {
        let form = "multipart/form-data; boundary=B";
        service.upload_twice(query, form, body, usize::from(piece) * 4);
    });
});
