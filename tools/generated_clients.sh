#!/usr/bin/env bash
# Generates clients from openapi/openapi.json and tracks the sample clip with them, unchanged, against a real server.
#
#     tools/generated_clients.sh [PROGRAM]
#
# openapi-python-client and openapi-generator come from PyPI, TypeScript and openapi-typescript from npm; Java runs
# openapi-generator. The Go client needs the standard library alone. The Java client of the library `native` needs
# Jackson, which is in openapi-generator's own jar, and Debian's libjakarta-annotation-api-java. What cannot be had is
# left out, and a line says so. Kotlin, and Java's default library okhttp-gson, are generated only: their libraries come
# from Maven Central. Swift is compiled where swift is installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=$(realpath "${1:-target/debug/bagtrack}")
python_client=0.29.0
generator=7.26.0
typescript=7.0.2
openapi_typescript=7.13.0

here=tools/generated_clients
out=target/generated_clients
mkdir -p "$out"
log=$(mktemp)
"$program" serve --listen 127.0.0.1:0 --log-format json 2>"$log" &
server=$!
trap 'kill "$server"; wait "$server" || true; rm -f "$log"' EXIT
until url=$(grep --only-matching --max-count=1 'http://127[0-9.:]*' "$log"); do
    kill -0 "$server"
    sleep 0.1
done

left_out() {
    echo "Left out, for want of $1: $2"
}

if ! python3 -m venv "$out/environment" || ! "$out/environment/bin/pip" install --quiet --disable-pip-version-check \
    "openapi-python-client==$python_client" "openapi-generator-cli==$generator"; then
    left_out "Python 3 with venv, or PyPI" "all generated clients"
    exit 0
fi
python=$out/environment/bin/python

rm -rf "$out/generated_by_openapi_python_client"
"$out/environment/bin/openapi-python-client" generate --path openapi/openapi.json --meta none \
    --output-path "$out/generated_by_openapi_python_client" >"$out/openapi-python-client.log" 2>&1
PYTHONPATH=$out:$here "$python" "$here/openapi_python_client.py" "$program" "$url"

if ! command -v java >/dev/null; then
    left_out "Java" "the clients of openapi-generator"
    exit 0
fi

generate() {
    rm -rf "${out:?}/$1"
    "$out/environment/bin/openapi-generator-cli" generate --generator-name "$1" --input-spec openapi/openapi.json \
        --output "$out/$1" "${@:2}" >"$out/$1.log" 2>&1 || { cat "$out/$1.log"; return 1; }
}

generate python
"$out/environment/bin/pip" install --quiet --disable-pip-version-check --requirement "$out/python/requirements.txt"
PYTHONPATH=$out/python:$here "$python" "$here/openapi_generator.py" "$program" "$url"

# A model that is only ever a form is imported, and without this it is not there.
generate typescript-fetch --global-property skipFormModel=false --additional-properties importFileExtension=.js
if command -v npm >/dev/null &&
    npm install --silent --no-audit --no-fund --prefix "$out/npm" "typescript@$typescript" &&
    # It has a compiler of its own.
    npm install --silent --no-audit --no-fund --prefix "$out/openapi-typescript" \
        "openapi-typescript@$openapi_typescript" typescript@5.9.3; then
    bin=$out/npm/node_modules/.bin
    rm -rf "$out/typescript"
    mkdir "$out/typescript"
    cp "$here/typescript.ts" "$out/typescript/main.ts"
    cp -r "$out/typescript-fetch" "$out/typescript/generated"
    echo '{"type": "module"}' >"$out/typescript/package.json"
    "$bin/tsc" --strict --target es2022 --module es2022 --moduleResolution bundler --lib es2022,dom --types "" \
        --outDir "$out/typescript/built" "$out/typescript/main.ts"
    cp "$out/typescript/package.json" "$out/typescript/built/"
    node "$out/typescript/built/main.js" "$url"
    "$out/openapi-typescript/node_modules/.bin/openapi-typescript" openapi/openapi.json --output "$out/typescript/openapi.d.ts" >/dev/null
    "$bin/tsc" --strict --noEmit --skipLibCheck false "$out/typescript/openapi.d.ts"
    echo "openapi-typescript: its types compile"
else
    left_out "Node.js and npm" "compiling the TypeScript clients"
fi

tracks() {
    PYTHONPATH=$here "$python" "$here/compiled.py" "$program" "$url" "$@"
}

if command -v go >/dev/null; then
    generate go --additional-properties withGoMod=false,packageName=bagtrack,generateInterfaces=false
    # Its tests need another module.
    rm -rf "$out/go/test"
    printf 'module bagtrack\n\ngo 1.19\n' >"$out/go/go.mod"
    mkdir "$out/go/track"
    cp "$here/main.go" "$out/go/track/"
    (cd "$out/go" && GOPROXY=off GOTOOLCHAIN=local go build -o client ./track)
    tracks "openapi-generator, Go" "$out/go/client"
else
    left_out "Go" "the Go client"
fi

annotations=/usr/share/java/jakarta-annotation-api.jar
if command -v javac >/dev/null && [ -f "$annotations" ]; then
    # As with TypeScript, a model that is only ever a form is imported.
    generate java --library native --global-property skipFormModel=false \
        --additional-properties openApiNullable=false,useJakartaEe=true,hideGenerationTimestamp=true
    jar=$("$python" -c 'import openapi_generator_cli, pathlib
print(next(pathlib.Path(openapi_generator_cli.__file__).parent.glob("*.jar")))')
    mkdir "$out/java/built"
    find "$out/java/src/main/java" -name '*.java' >"$out/java/sources"
    javac -nowarn -Xlint:none -cp "$jar:$annotations" -d "$out/java/built" @"$out/java/sources" "$here/Main.java"
    tracks "openapi-generator, Java (native)" java -cp "$out/java/built:$jar:$annotations" Main
    rm -rf "$out/java-native"
    mv "$out/java" "$out/java-native"
else
    left_out "javac or libjakarta-annotation-api-java" "the Java client"
fi
generate java
grep --recursive --quiet 'CreatedSession createSession(.*File body,' "$out/java/src/main"
left_out "okhttp from Maven Central" "compiling the Java client of the default library"

# They are not compiled, but they must take frames as files, not as base64 in JSON.
generate kotlin
grep --recursive --quiet 'fun createSession(body: java.io.File,' "$out/kotlin/src/main"
generate swift6
grep --recursive --quiet 'func createSession(body: URL,' "$out/swift6/Sources"
echo "openapi-generator, Kotlin and Swift: frames are files"
left_out "okhttp and moshi from Maven Central" "compiling the Kotlin client"
if command -v swift >/dev/null; then
    swift build --package-path "$out/swift6"
else
    left_out "swift" "compiling the Swift client"
fi
