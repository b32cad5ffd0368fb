"""Renders deploy/helm with Helm, and checks each object with the schemas of Kubernetes, and that they fit together.

`tools/helm_chart.sh` makes the environment. The argument is a folder of npm packages with the PodMonitor's schema.
"""

import json
import pathlib
import shlex
import subprocess
import sys

import helm_python as helm
import kubernetes_validate
import yaml

CHART = pathlib.Path("deploy/helm")
# The oldest one that the chart takes, and a new one.
KUBERNETES = ["1.30", "1.37"]
INSTALLATIONS = {
    "alone": {},
    "replicas": {
        "store": "redis://:password@redis:6379",
        "autoscaling": {"enabled": True},
        "podMonitor": {"enabled": True, "labels": {"release": "prometheus"}},
    },
    "outside": {
        "replicas": 3,
        "store": "rediss://redis:6380",
        "secret": {"apiKeys": "anna:0123456789abcdef,ben:fedcba9876543210", "metricsKey": "m" * 16},
        "ingress": {
            "enabled": True,
            "className": "haproxy",
            "host": "tracker.example.org",
            "path": "/tracker",
            "annotations": {"cert-manager.io/cluster-issuer": "letsencrypt"},
        },
        "networkPolicy": {
            "from": [{"namespaceSelector": {"matchLabels": {"kubernetes.io/metadata.name": "ingress"}}}],
            "storePort": 6380,
            "egress": [{"ports": [{"protocol": "TCP", "port": 4318}]}],
        },
    },
    "own secret": {
        "secret": {"existing": "keys"},
        "networkPolicy": {"enabled": False},
        "imagePullSecrets": [{"name": "registry"}],
        "nodeSelector": {"kubernetes.io/arch": "arm64"},
        "tolerations": [{"key": "batch", "operator": "Exists"}],
        "podAnnotations": {"example.org/team": "video"},
        "settings": {"SSL_CERT_FILE": "/roots/ca.crt"},
        "extraVolumes": [{"name": "roots", "configMap": {"name": "roots"}}],
        "extraVolumeMounts": [{"name": "roots", "mountPath": "/roots", "readOnly": True}],
    },
}
# What the service takes (crates/sessions/src/store/redis/address.rs), as far as pods can reach it.
STORES = [f"{name}{tls}{cluster}://:password@a:7000,b:7001" for name in ("redis", "valkey") for tls in ("", "s")
          for cluster in ("", "-cluster")]
KEYS = {
    "0123456789abcdef": "0123456789abcdef",
    "anna:0123456789abcdef": "0123456789abcdef",
    "anna:0123456789abcdef,ben:fedcba9876543210": "0123456789abcdef",
    "anna:0123456789:abcdef,ben:fedcba9876543210": "0123456789:abcdef",
}
"""The key that the notes show, by the keys that there are."""
REFUSED = {
    "a misspelt value": ({"replica": 3}, "replica"),
    "replicas without a store": ({"replicas": 2}, "needs a store"),
    "an ingress without a host": ({"ingress": {"enabled": True}}, "ingress.host"),
    "a store of another kind": ({"store": "file:/var/lib/bagtrack"}, "store"),
    "a store in a socket, which no pod has": ({"store": "unix:///run/redis.sock"}, "store"),
    "a key without a name": ({"secret": {"apiKeys": "anna:0123456789abcdef,fedcba9876543210"}}, "number 2 is not name"),
    "keys without names": ({"secret": {"apiKeys": "0123456789abcdef,fedcba9876543210"}}, "number 1 is not name"),
}


def rendered(chart: helm.Chart, values: dict) -> list[dict]:
    """The objects that an installation with these values makes."""
    chart.validate_schema(values)
    files = chart.render(values, name="bagtrack", namespace="video", is_install=True)
    texts = [text for path, text in files.items() if path.endswith(".yaml")]
    return [it for text in texts for it in yaml.safe_load_all(text) if it]


def validate(document: dict, packages: pathlib.Path) -> None:
    """Fails where a schema does not have a field, or not with this value."""
    if document["kind"] != "PodMonitor":
        for version in KUBERNETES:
            kubernetes_validate.validate(document, version, strict=True)
    elif (packages / "@kubernetes-models").is_dir():
        script = """
            import { PodMonitor } from "@kubernetes-models/prometheus-operator/monitoring.coreos.com/v1/PodMonitor";
            new PodMonitor(JSON.parse(process.argv[1])).validate();
        """
        command = ["node", "--input-type=module", "-e", script, json.dumps(document)]
        subprocess.run(command, check=True, cwd=packages.parent)


def fits(objects: list[dict], own_secret: bool) -> None:
    """The objects name each other: keys of the secret, labels of the pods, names of the ports."""
    by_kind = {it["kind"]: it for it in objects}
    pod = by_kind["Deployment"]["spec"]["template"]
    container = pod["spec"]["containers"][0]
    labels = pod["metadata"]["labels"].items()
    ports = {it["name"] for it in container["ports"]}

    # ffmpeg writes there.
    mounts = {it["mountPath"]: it["name"] for it in container["volumeMounts"]}
    assert "/tmp" in mounts and set(mounts.values()) == {it["name"] for it in pod["spec"]["volumes"]}

    variables = [it["name"] for it in container["env"]]
    assert len(variables) == len(set(variables)), variables
    references = [it["valueFrom"]["secretKeyRef"] for it in container["env"] if "valueFrom" in it]
    monitor = by_kind.get("PodMonitor")
    if monitor:
        endpoint = monitor["spec"]["podMetricsEndpoints"][0]
        references.append(endpoint["authorization"]["credentials"])
        assert endpoint["port"] in ports
        assert pod["metadata"]["labels"][monitor["spec"]["jobLabel"]] == "bagtrack"
    if own_secret:
        assert "Secret" not in by_kind and {it["name"] for it in references} == {"keys"}
    else:
        secret = by_kind["Secret"]
        for reference in references:
            assert reference["name"] == secret["metadata"]["name"] and secret["stringData"][reference["key"]]
        assert all(":" in it for it in secret["stringData"]["api-keys"].split(","))

    selectors = [it["spec"]["selector"] for it in objects if it["kind"] == "Service"]
    assert len(selectors) == 2
    for kind, field in [("Deployment", "selector"), ("PodDisruptionBudget", "selector"), ("PodMonitor", "selector"),
                        ("NetworkPolicy", "podSelector")]:
        if kind in by_kind:
            selectors.append(by_kind[kind]["spec"][field]["matchLabels"])
    assert all(it.items() <= labels for it in selectors), selectors

    services = {it["metadata"]["name"]: {port["name"] for port in it["spec"]["ports"]} for it in objects
                if it["kind"] == "Service"}
    if "Ingress" in by_kind:
        backend = by_kind["Ingress"]["spec"]["rules"][0]["http"]["paths"][0]["backend"]["service"]
        assert backend["port"]["name"] in services[backend["name"]]
    if "HorizontalPodAutoscaler" in by_kind:
        target = by_kind["HorizontalPodAutoscaler"]["spec"]["scaleTargetRef"]
        assert target["name"] == by_kind["Deployment"]["metadata"]["name"]
        assert "replicas" not in by_kind["Deployment"]["spec"]


def shown_key(chart: helm.Chart, keys: str) -> str:
    """The key that the notes' command prints."""
    files = chart.render({"secret": {"apiKeys": keys}}, name="bagtrack", namespace="video", is_install=True)
    texts = {path.rsplit("/", 1)[-1]: text for path, text in files.items()}
    command = next(it for it in texts["NOTES.txt"].splitlines() if it.startswith("KEY="))
    stored = yaml.safe_load(texts["secret.yaml"])["stringData"]["api-keys"]
    script = f'kubectl() {{ printf %s "$1" | base64; }}\n{command}\nprintf %s "$KEY"'
    script = script.replace("$(kubectl", f"$(kubectl {shlex.quote(stored)}")
    return subprocess.run(["bash", "-c", script], check=True, capture_output=True, text=True).stdout


def main() -> None:
    packages = pathlib.Path(sys.argv[1])
    chart = helm.Chart.load(CHART)
    cargo = next(it for it in pathlib.Path("Cargo.toml").read_text().splitlines() if it.startswith("version = "))
    version = cargo.split('"')[1]
    assert (chart.version, chart.metadata["appVersion"]) == (version, version), chart.metadata

    report = helm.lint(CHART, strict=True, kube_version="v1.30.0")
    # An icon is recommended, and there is none.
    found = [it for it in report["messages"] if "icon is recommended" not in it["error"]]
    assert not found and not report["errors"], report

    kinds = set()
    for name, values in INSTALLATIONS.items():
        objects = rendered(chart, values)
        for document in objects:
            validate(document, packages)
        fits(objects, own_secret=name == "own secret")
        kinds |= {it["kind"] for it in objects}
        print(f"{name}: {len(objects)} objects")
    for store in STORES:
        chart.validate_schema({"store": store})
    for keys, first in KEYS.items():
        assert shown_key(chart, keys) == first, (keys, shown_key(chart, keys))
    templates = {it["name"] for it in chart.templates if it["name"].endswith(".yaml")}
    # Services are two in one file.
    assert len(kinds) == len(templates), (kinds, templates)

    for what, (values, word) in REFUSED.items():
        try:
            rendered(chart, values)
        except helm.HelmError as error:
            assert word in str(error), error
        else:
            raise AssertionError(f"{what} is taken")
    print(f"{len(REFUSED)} values refused")


if __name__ == "__main__":
    main()
