{{- /* The name of all objects: the release's. */ -}}
{{- define "bagtrack.name" -}}
{{- .Release.Name | trunc 53 | trimSuffix "-" -}}
{{- end -}}

{{- /* What the pods of this release are found by. */ -}}
{{- define "bagtrack.selector" -}}
app.kubernetes.io/name: bagtrack
app.kubernetes.io/instance: {{ .Release.Name }}
{{- end -}}

{{- define "bagtrack.labels" -}}
{{ include "bagtrack.selector" . }}
app.kubernetes.io/version: {{ .Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ .Release.Service }}
helm.sh/chart: {{ .Chart.Name }}-{{ .Chart.Version }}
{{- end -}}

{{- define "bagtrack.secret" -}}
{{- .Values.secret.existing | default (include "bagtrack.name" .) -}}
{{- end -}}

{{- /* A key of the Secret: as given, as it was, or new. Call with (list . "name" "given"). */ -}}
{{- define "bagtrack.key" -}}
{{- $root := index . 0 -}}
{{- $before := (lookup "v1" "Secret" $root.Release.Namespace (include "bagtrack.name" $root)).data | default dict -}}
{{- $given := index . 2 -}}
{{- if $given -}}
{{- $given -}}
{{- else if hasKey $before (index . 1) -}}
{{- get $before (index . 1) | b64dec -}}
{{- else -}}
{{- randAlphaNum 43 -}}
{{- end -}}
{{- end -}}
