// Tracks the frames of a folder with the Go client that openapi-generator generates: `URL FOLDER BOX SEED`.
//
// It prints a line for each frame but the first: number, x, y, width, height, status.
package main

import (
	"bytes"
	"context"
	"fmt"
	"io"
	"os"
	"path/filepath"
	"strconv"
	"time"

	"bagtrack"
)

func must[T any](value T, err error) T {
	if err != nil {
		panic(err)
	}
	return value
}

func main() {
	url, folder, box := os.Args[1], os.Args[2], os.Args[3]
	seed := must(strconv.ParseInt(os.Args[4], 10, 64))
	configuration := bagtrack.NewConfiguration()
	configuration.Servers = bagtrack.ServerConfigurations{{URL: url}}
	sessions, ctx := bagtrack.NewAPIClient(configuration).SessionsAPI, context.Background()
	frames := must(filepath.Glob(filepath.Join(folder, "*.jpg")))
	session, _, err := sessions.CreateSession(ctx).Body(must(os.Open(frames[0]))).Box(box).Seed(seed).Execute()
	must(session, err)
	started := time.Now()
	for number, path := range frames[1:] {
		file := must(os.Open(path))
		answer, _, err := sessions.PostFrames(ctx, session.Id).Body(file).Frame(int64(number + 1)).Execute()
		must(answer, err)
		file.Close()
		b := answer.Box
		fmt.Println(answer.Frame, b.X, b.Y, b.Width, b.Height, answer.Status)
	}
	fmt.Fprintln(os.Stderr, time.Since(started).Seconds()*1000/float64(len(frames)-1))
	// A seed that the service draws has up to 53 bits.
	drawn, _, err := sessions.CreateSession(ctx).Body(must(os.Open(frames[0]))).Box(box).Verbose(true).Execute()
	must(drawn, err)
	if drawn.Parameters.GetSeed() < 0 {
		panic("a negative seed")
	}
	text := filepath.Join(folder, "no picture")
	if err := os.WriteFile(text, []byte("\x00 no picture"), 0o600); err != nil {
		panic(err)
	}
	_, response, err := sessions.PostFrames(ctx, session.Id).Body(must(os.Open(text))).Execute()
	refused, is := err.(*bagtrack.GenericOpenAPIError)
	if !is || response.StatusCode != 415 {
		panic(fmt.Sprint("no picture was taken: ", err))
	}
	if problem := refused.Model().(bagtrack.Problem); problem.Type != "/docs/problems#unsupported-image" {
		panic(problem.Type)
	}
	// An answer that is no JSON is refused, but it is there.
	_, response, err = sessions.PostFrames(ctx, session.Id).Body(must(os.Open(frames[0]))).Draw(true).Execute()
	picture := must(io.ReadAll(response.Body))
	if err == nil || response.StatusCode != 200 || !bytes.HasPrefix(picture, []byte("\x89PNG")) {
		panic(fmt.Sprint("nothing was drawn: ", err))
	}
	for _, id := range []string{session.Id, drawn.Id} {
		if _, err := sessions.DeleteSession(ctx, id).Execute(); err != nil {
			panic(err)
		}
	}
}
