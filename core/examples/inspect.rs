fn main() {
    let a: Vec<String> = std::env::args().collect();
    let l = suture_core::Limits { chunk_triangles: a[1].parse().unwrap(), threads: 2, memory_bytes: 8<<30, ..Default::default() };
    for f in &a[2..] {
        match suture_core::inspect(f.as_ref(), &Default::default(), &l, &suture_core::Quiet) {
            Ok(r) => println!("{}", serde_json::to_string(&r).unwrap()),
            Err(e) => println!("{{\"error\": {:?}, \"input\": {{\"path\": {:?}}}}}", e.to_string(), f),
        }
    }
}
